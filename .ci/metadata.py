"""What a package index shows: README with links that work there, and the project's addresses.

hatchling runs this when it builds (pyproject.toml, tool.hatch.metadata.hooks.custom). The address
of the public repository is one setting there, `url`; `make release URL=...` fills it in. While it
is empty, README goes in as it is and no address is shown.
"""

import re
from pathlib import Path

from hatchling.metadata.plugin.interface import MetadataHookInterface

# Of Markdown: ](target) and ![alternative](target); addresses and anchors stay.
_LINK = re.compile(r"(?P<picture>!?)\[(?P<text>[^\]]*)\]\((?P<target>(?!\w+:|#)[^)\s]+)\)")


def absolute(markdown, url, version):
    """Markdown with every link within the repository as an address, at the tag of the version."""

    def replacement(link):
        kind = "raw" if link["picture"] else "blob"
        target = f"{url}/{kind}/v{version}/{link['target']}"
        return f"{link['picture']}[{link['text']}]({target})"

    return _LINK.sub(replacement, markdown)


def addresses(url, version):
    """Addresses by what an index calls them."""
    return {
        "Source": url,
        "Issues": f"{url}/issues",
        "Documentation": f"{url}/tree/v{version}/docs",
        "Changelog": f"{url}/blob/v{version}/CHANGELOG.md",
    }


class CustomMetadataHook(MetadataHookInterface):
    def update(self, metadata):
        url, version = self.config.get("url", "").rstrip("/"), metadata["version"]
        text = Path(self.root, "README.md").read_text(encoding="utf-8")
        metadata["urls"] = addresses(url, version) if url else {}
        if url:
            text = absolute(text, url, version)
        metadata["readme"] = {"content-type": "text/markdown", "text": text}
