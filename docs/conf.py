"""The documentation site; `make docs` builds it into out/docs, without network."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path

import quadfringe

ROOT = Path(__file__).resolve().parents[1]
REPOSITORY = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]["repository"]

project = "quadfringe"
author = "the quadfringe contributors"
copyright = "the quadfringe contributors; MIT or Apache-2.0"  # noqa: A001 - Sphinx reads this name
version = release = quadfringe.__version__

extensions = [
    "myst_nb",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
    "glossary_terms",
    "mathml",
    "site_pages",
]
exclude_patterns = ["extensions", "gallery", "_static", "generated/**/*.ipynb", "generated/**/*.py"]
smartquotes = False  # two hyphens begin an option

# Pages: Markdown as GitHub reads it, and notebooks as text. Every cell of them runs at every build.
myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 4
myst_dmath_double_inline = True
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 120
nb_execution_show_tb = True
nb_merge_streams = True

# The reference
autosummary_generate = False
autodoc_typehints = "signature"
autodoc_member_order = "bysource"
maximum_signature_line_length = 88
autodoc_preserve_defaults = True
numpydoc_show_class_members = False
default_role = "py:obj"
python_use_unqualified_type_names = True
toc_object_entries_show_parents = "hide"

# The gallery: every script runs when it was changed since the last build.
sphinx_gallery_conf = {
    "examples_dirs": ["gallery"],
    "gallery_dirs": ["generated/gallery"],
    "backreferences_dir": "generated/uses",
    "doc_module": ("quadfringe",),
    "within_subsection_order": "FileNameSortKey",
    "reset_modules": ("gallery_style.apply",),
    "capture_repr": (),
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_signature": False,
    "remove_config_comments": True,
    "thumbnail_size": (600, 270),
    "min_reported_time": 3600,
    "write_computation_times": False,
    "notebook_extensions": set(),
}

# Names of other projects become links when the inventories may be fetched: QUADFRINGE_INTERSPHINX=1 make docs
if os.environ.get("QUADFRINGE_INTERSPHINX"):
    extensions.append("sphinx.ext.intersphinx")
    intersphinx_mapping = {
        "python": ("https://docs.python.org/3", None),
        "numpy": ("https://numpy.org/doc/stable", None),
        "h5py": ("https://docs.h5py.org/en/stable", None),
    }

html_theme = "pydata_sphinx_theme"
html_title = f"quadfringe {version}"
html_logo = "_static/logo.svg"
html_favicon = "_static/favicon.svg"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_copy_source = False
html_math_renderer = "mathml"
html_sidebars = {"hardware": [], "accuracy": [], "troubleshooting": [], "performance": [], "changelog": []}
pygments_style = "tango"
html_theme_options = {
    "logo": {"text": "quadfringe"},
    "show_nav_level": 1,
    "show_toc_level": 2,
    "navigation_depth": 2,
    "header_links_before_dropdown": 6,
    "navbar_align": "left",
    "navigation_with_keys": False,
    "show_prev_next": True,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": ["sphinx-version"],
    "pygments_light_style": "tango",
    "pygments_dark_style": "monokai",
    "icon_links": [{"name": "Repository", "url": REPOSITORY, "icon": "fa-brands fa-github"}],
}
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True
