"""Configuration of Sphinx for `make docs`. The pages are Markdown files of the whole repository."""

from baldwinlab._version import __version__

project = "baldwinlab"
html_title = f"baldwinlab {__version__}"
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "numpydoc",
    "cyclopts.ext.sphinx",
    "scripts.site_extension",
]
root_doc = "README"
include_patterns = [
    "*.md",
    "docs/*.md",
    "docs/**/*.md",
    "notebooks/*.md",
    "benchmarks/*.md",
    "baldwinlab/papers/*/README.md",
]
exclude_patterns = [".*", "build", "dist", "results", "site", "tests", "notebooks/results"]

myst_heading_anchors = 6
# The docstrings have code in single backticks.
default_role = "code"
numpydoc_show_class_members = False
# Signatures have the names of these types.
autodoc_type_aliases = {"Module": "Module", "Sample": "Sample"}
autosummary_generate = False
# Sphinx would replace the two dashes of an option by a long dash.
smartquotes = False
# The language of code blocks that name none.
highlight_language = "text"

html_theme = "furo"
html_copy_source = False
# The search fetches pages for its summaries. A browser refuses this for files on disk.
html_show_search_summary = False
html_show_copyright = False
html_static_path = ["site.css"]
# The extension of the site writes fonts.css.
html_css_files = ["fonts.css", "site.css"]
html_favicon = "../baldwinlab/lab/static/icon.svg"
