"""Without skl2onnx, the converter says how to get it."""

import sys

import pytest

from skanfis.export import register_onnx_converter


def test_missing_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "skl2onnx", None)
    with pytest.raises(ImportError, match=r"pip install skl2onnx onnxruntime .*'\.\[onnx\]'"):
        register_onnx_converter()
