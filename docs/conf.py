"""Sphinx configuration of the documentation site (`make docs`). Every warning and every broken reference is an error."""

from __future__ import annotations

import sys
from pathlib import Path

from manitwin.formats.installation import installed_version

sys.path.insert(0, str(Path(__file__).parent))  # for the extension reference_directives

project = "ManiTwin"
author = "The ManiTwin authors"
copyright = "The ManiTwin authors, Apache-2.0"
version = release = installed_version()

extensions = ["myst_parser", "sphinx.ext.autodoc", "reference_directives"]
exclude_patterns = ["examples/**"]
myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence"]
smartquotes = False  # keeps --vlm as written

html_theme = "furo"
html_title = "ManiTwin"
html_show_copyright = False
html_copy_source = False
html_theme_options = {"navigation_with_keys": True}

autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_class_signature = "separated"  # fields are documented below the class, not in its signature
autodoc_preserve_defaults = True
add_module_names = False
maximum_signature_line_length = 100
toc_object_entries_show_parents = "hide"
python_use_unqualified_type_names = True

nitpicky = True
# Types of other packages are not linked, since the build loads nothing external.
nitpick_ignore_regex = [
    (r"py:class", r"manitwin\.config\.load\.Kind"),  # a type variable
    (r"py:.*", r"(np|numpy|trimesh|pathlib|Path|pa|pyarrow|mujoco|sapien|collections|typing|duckdb|_duckdb)(\..*)?"),
]
