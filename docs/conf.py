"""How Sphinx makes the site; `python dev.py docs` gathers the pages and calls it."""

import sheldrake

project = "sheldrake"
author = "the sheldrake authors"
release = sheldrake.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]

html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_title = f"sheldrake {release}"
html_show_copyright = False
html_show_sphinx = False
html_theme_options = {"navigation_with_keys": True}

myst_heading_anchors = 3
default_role = "code"  # docstrings put names of things in single backquotes
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
napoleon_use_rtype = False
napoleon_use_ivar = True


def setup(app):
    """Docstrings are prose, and signatures say what a parameter is, or nothing."""
    from api_pages import as_prose, shorter

    def docstring(app, what, name, thing, options, lines):
        lines[:] = [as_prose(line) for line in lines]

    def signature(app, what, name, thing, options, text, returns):
        return shorter(text), shorter(returns)

    app.connect("autodoc-process-docstring", docstring)
    app.connect("autodoc-process-signature", signature)
