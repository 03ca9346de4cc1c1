"""Sphinx configuration of the documentation, which `make docs` builds. Reference pages are generated from the code."""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from drawings import write_drawings  # noqa: E402
from finish import finish  # noqa: E402
from pages import write_pages  # noqa: E402
from strips import write_strips  # noqa: E402

import texrs  # noqa: E402

project = "texrs"
author = "the texrs developers"
version = release = texrs.__version__
extensions = ["sphinx.ext.autodoc", "sphinx.ext.extlinks", "numpydoc", "myst_parser", "sphinx_gallery.gen_gallery"]
exclude_patterns = [
    "_build",
    "pictures",
    "generated/drawings/*.md",
    "generated/strips/*.md",
    "generated/install.md",
    "generated/parameters/*.md",
    "generated/extra",
    "gallery/README.rst",
    "generated/gallery/*.ipynb",
    "generated/gallery/*.py",
]
default_role = "py:obj"
# Smart quotes would replace the two dashes of options.
smartquotes = False
myst_enable_extensions = ["deflist", "colon_fence"]
myst_heading_anchors = 3

extlinks = {"doi": ("https://doi.org/%s", "doi:%s")}
autodoc_typehints = "none"
autodoc_member_order = "alphabetical"
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

html_theme = "pydata_sphinx_theme"
html_title = "texrs"
html_static_path = ["static"]
html_extra_path = ["generated/extra"]
html_css_files = ["texrs.css"]
html_show_sourcelink = False
# Pages outside of all sections, which have no sidebar.
ALONE = ("index", "install", "five-minutes", "promises", "coming-from", "conventions", "help", "genindex", "search")
MADE = ("words", "comparison", "performance", "commands", "results", "messages")
html_sidebars = {name: [] for name in (*ALONE, *(f"generated/{name}" for name in MADE))}
html_theme_options = {
    "navigation_with_keys": False,
    "show_toc_level": 2,
    # The reference has a page for each function.
    "collapse_navigation": True,
    "header_links_before_dropdown": 6,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
copyright = "the texrs developers; MIT or Apache-2.0"

sphinx_gallery_conf = {
    "examples_dirs": ["gallery"],
    "gallery_dirs": ["generated/gallery"],
    "filename_pattern": r"/plot_",
    "capture_repr": (),
    "download_all_examples": False,
    "remove_config_comments": True,
    "reset_modules": ("matplotlib",),
    # The page of computation times would load scripts from another server.
    "write_computation_times": False,
    "show_memory": False,
    "show_signature": False,
    "plot_gallery": True,
    "abort_on_example_error": True,
}

write_drawings(HERE / "generated")
write_strips(HERE / "generated")
write_pages(HERE)


def setup(app: object) -> None:
    app.connect("build-finished", finish)  # type: ignore[attr-defined]
