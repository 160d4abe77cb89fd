"""Carrying a trained model away: other formats, other languages."""

from .c import CCode, CCost, export_c
from .fis import export_fis, read_fis, write_fis
from .folding import fold, fold_with_reader, fold_with_rows, found_by_search, last_step
from .model_json import export_json, read_json, write_json
from .onnx import register_onnx_converter
from .trusted import TRUSTED_TYPES

__all__ = [
    "TRUSTED_TYPES",
    "CCode",
    "CCost",
    "export_c",
    "export_fis",
    "export_json",
    "fold",
    "fold_with_reader",
    "fold_with_rows",
    "found_by_search",
    "last_step",
    "read_fis",
    "read_json",
    "register_onnx_converter",
    "write_fis",
    "write_json",
]
