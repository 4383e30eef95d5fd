"""The site's settings: `make docs` builds it into docs/_build, with every warning as an error."""

import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tools"))

import site_pages

import projdist

project = "projdist"
author = "The projdist developers"
project_copyright = author
release = version = projdist.__version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "myst_nb",
]
exclude_patterns = ["_build", "atlas.md"]  # made/atlas has the same page, with one of each place
source_suffix = {".rst": "restructuredtext", ".md": "myst-nb", ".ipynb": "myst-nb"}
myst_enable_extensions = ["attrs_inline"]
myst_heading_anchors = 3
nb_execution_mode = "off"  # notebooks hold their outputs; `make notebooks` makes and checks them
autosummary_generate = True
templates_path = ["site_templates"]
autodoc_typehints = "none"  # numpydoc's sections have them
numpydoc_show_class_members = False

# Other projects' indices come from the network, which a build has only where it is told so.
if os.environ.get("PROJDIST_DOCS_ONLINE"):
    extensions.append("sphinx.ext.intersphinx")
intersphinx_mapping = {
    "python": ("https://docs.python.org/3", None),
    "numpy": ("https://numpy.org/doc/stable", None),
    "pyproj": ("https://pyproj4.github.io/pyproj/stable", None),
    "geopandas": ("https://geopandas.org/en/stable", None),
    "matplotlib": ("https://matplotlib.org/stable", None),
}

html_theme = "pydata_sphinx_theme"
html_title = "projdist"
html_favicon = "site_static/favicon.svg"
html_show_sourcelink = False
html_static_path = ["site_static", "../projdist/web/tables.js"]
html_css_files = ["sortable.css"]
html_js_files = [("sortable.js", {"type": "module"})]
html_theme_options = {
    "show_prev_next": False,
    "header_links_before_dropdown": 7,
    "secondary_sidebar_items": ["page-toc"],
}


def setup(app):
    """Write the pages that are made from the program itself before any is read."""
    app.connect("config-inited", lambda app, _: site_pages.write(Path(app.srcdir)))
    app.connect("source-read", site_pages.relink)
