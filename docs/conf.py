"""Sphinx configuration of the documentation: ``sphinx-build -W --keep-going docs docs/_build/html``."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "docs" / "scripts")]

import make_api_reference  # noqa: E402
import make_cli_reference  # noqa: E402

import gfimu  # noqa: E402

make_api_reference.write_pages()
make_cli_reference.write_pages()

project = "gfimu"
author = "The gfimu developers"
copyright = author  # noqa: A001
version = release = gfimu.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "sphinx-mathjax-offline",
    "sphinx_copybutton",
    "sphinx_design",
]
exclude_patterns = ["_build", "scripts", "examples", "paper", "**.ipynb_checkpoints"]

# Markdown: anchors of headings as on GitHub, so that a page can be read there and here.
myst_enable_extensions = ["dollarmath", "colon_fence", "deflist", "attrs_inline"]
myst_heading_anchors = 4
myst_dmath_double_inline = True
nb_execution_mode = "off"  # tests execute the notebooks

# API: from docstrings in numpydoc form. Names in backticks link where they are documented.
highlight_language = "none"  # of blocks that name none: commands and their output
default_role = "py:obj"
autodoc_typehints = "none"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True}
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
python_use_unqualified_type_names = True
toc_object_entries_show_parents = "hide"

html_theme = "furo"
html_title = f"gfimu {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_show_search_summary = False  # summaries are fetched, which browsers refuse for files
html_copy_source = False
copybutton_prompt_text = "$ "
copybutton_only_copy_prompt_lines = True
