"""How Sphinx makes the documentation: `make docs`."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tools"))

from flowborne import __version__

project = "flowborne"
release = __version__
html_title = "flowborne"

extensions = ["myst_parser", "sphinx.ext.autodoc", "handbook"]
exclude_patterns = ["_build", "validation"]
myst_enable_extensions = ["dollarmath", "html_image", "colon_fence"]
myst_fence_as_directive = ["mermaid"]
myst_heading_anchors = 3
smartquotes = False
default_role = "code"
highlight_language = "text"

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_type_aliases = {name: name for name in ("Array", "Integers", "Indices", "Mask", "Bodies")}
autodoc_preserve_defaults = True
python_maximum_signature_line_length = 80

html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["handbook.css"]
html_js_files = ["turn.js"]
html_math_renderer = "mathml"
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False
html_theme_options = {"navigation_with_keys": True}
