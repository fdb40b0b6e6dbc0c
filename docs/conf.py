"""How Sphinx builds these documents: `make docs`, into docs/_build/html."""

from __future__ import annotations

import importlib
import inspect
import re
import shutil
import sys
import types
import warnings
from pathlib import Path

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from matplotlib import pyplot
from pygments.lexers.shell import BashLexer
from pygments.token import Name, Number
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator
from sphinx_gallery.scrapers import matplotlib_scraper

import focalgradient
from focalgradient.cli import main
from focalgradient.dataset.markers import MARKERS
from focalgradient.tasks import task_named
from focalgradient.tasks.registry import OURS

ROOT = Path(__file__).parent
sys.path.insert(0, str(ROOT))
import figure_pages  # noqa: E402
import notebook  # noqa: E402
from figure_faults import check_figure  # noqa: E402  of analysis/, which figure_pages adds to the path

project = "focalgradient"
author = "the focalgradient maintainers"
version = release = focalgradient.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx_click",
    "sphinx_copybutton",
    "sphinx_gallery.gen_gallery",
    "sphinxcontrib.bibtex",
]
myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
bibtex_bibfiles = ["references.bib"]
autosummary_generate = True
autodoc_typehints = "signature"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_ivar = True
default_role = "code"  # in docstrings `name` is code
exclude_patterns = ["_build", "blur_page", "examples", "generated/*.md"]  # the last are included
suppress_warnings = [
    "config.cache",
    "misc.highlighting_failure",  # there is no lexer for CSV
    "ref.python",  # units in annotations, such as "seconds", are not references
]
nitpicky = False
templates_path = ["_templates"]

smartquotes_action = "qe"  # quotes and ellipses; dashes would change options like --out

html_math_renderer = "mathml"
html_static_path = ["_static"]
html_css_files = ["own.css"]
html_theme = "pydata_sphinx_theme"
html_title = "focalgradient"
html_theme_options = {"show_toc_level": 2, "navigation_with_keys": False, "secondary_sidebar_items": ["page-toc"]}


def whole_figures(block: tuple, variables: dict, conf: dict, **options: object) -> str:
    """Collect the figures of a gallery page; fail where one has content that is cut off or covered."""
    for number in pyplot.get_fignums():
        check_figure(pyplot.figure(number), variables["src_file"])
    return matplotlib_scraper(block, variables, conf, **options)


sphinx_gallery_conf = {
    "image_scrapers": (whole_figures,),
    "examples_dirs": ["examples"],
    "gallery_dirs": ["gallery"],
    "filename_pattern": r"/plot_",
    "backreferences_dir": "generated/backreferences",
    "doc_module": ("focalgradient",),
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_signature": False,
    "write_computation_times": False,  # a page that loads a script from elsewhere
    "remove_config_comments": True,
    "ignore_repr_types": r"matplotlib",  # what draws legends and axes also returns them
}

warnings.filterwarnings("ignore", message=".*Matplotlib is currently using agg.*")
ROOMS = re.findall(r"^   (focalgradient[\w.]*)$", (ROOT / "api.rst").read_text(encoding="utf-8"), re.MULTILINE)


def names(room: str) -> list[str]:
    """What a room's page lists: its functions and classes."""
    own = ((name, getattr(importlib.import_module(room), name)) for name in importlib.import_module(room).__all__)
    return [
        name for name, value in own if (inspect.isroutine(value) or inspect.isclass(value)) and value.__name__ == name
    ]


def tables_of_columns() -> str:
    """What the columns of the data sets' tables mean, as their sidecars say it."""
    rows = []
    for task in map(task_named, OURS):
        rows += [f"### {task.title} (`{task.name}`)", "", "| column | what it is | unit or values |", "|---|---|---|"]
        for column in task.columns():
            said = column.described()
            values = said.get("Units") or ", ".join(said.get("Levels", {})) or said.get("Format", "text")
            rows.append(f"| `{column.name}` | {said['Description']} | {values} |")
        rows.append("")
    return "\n".join(rows)


def table_of_markers() -> str:
    """Codes of the events that the experiments mark."""
    rows = [f"| {marker.code} | `{name}` | {marker.about} |" for name, marker in MARKERS.items()]
    return "\n".join(["| code | event | meaning |", "|---|---|---|", *rows])


(ROOT / "generated").mkdir(exist_ok=True)
(ROOT / "generated" / "markers.md").write_text(table_of_markers(), encoding="utf-8")
(ROOT / "generated" / "columns.md").write_text(tables_of_columns(), encoding="utf-8")


def write_command_pages(folder: Path) -> None:
    """Write a page for each command, of its `--help`, into `folder`; sphinx-click finds the commands in a module."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    module = sys.modules["documented_commands"] = types.ModuleType("documented_commands")
    for name, command in main.commands.items():
        attribute = name.replace("-", "_")
        setattr(module, attribute, command)
        directive = f".. click:: documented_commands:{attribute}\n   :prog: focalgradient {name}\n   :nested: full\n"
        (folder / f"{name}.rst").write_text(f"{name}\n{'=' * len(name)}\n\n{directive}", encoding="utf-8")


write_command_pages(ROOT / "generated" / "commands")

RESULTS = ROOT.parent / "results"
"""What `make reproduce` wrote."""

figure_pages.write(RESULTS, ROOT / "generated" / "figures")
if (RESULTS / "report.html").is_file():
    tags.add("reproduced")  # noqa: F821  Sphinx gives `tags`
    html_extra_path = [str(RESULTS / "report.html")]

autosummary_context = {"names": {room: names(room) for room in ROOMS}}
pages = {*ROOMS, *(f"{room}.{name}" for room, listed in autosummary_context["names"].items() for name in listed)}
for page in (ROOT / "generated").glob("*.rst"):
    if page.stem not in pages:  # of a name that is gone
        page.unlink()


LONGEST_WORD = 20
"""Maximum length in characters of a word of code that does not break in a table's cell or on a narrow page."""


class CommandLexer(BashLexer):
    """Tokenise commands: an option is one token, which does not break at its hyphens, as is a decimal number."""

    name = "focalgradient's commands"
    tokens = BashLexer.tokens | {
        "root": [
            (r"(?<!\S)--?[A-Za-z][\w-]*", Name.Attribute),
            (r"(?<![^\s=])[\d.,:+-]*\d(?=[\s=]|$)", Number),
            *BashLexer.tokens["root"],
        ]
    }


def formula(translator: HTML5Translator, node: nodes.math | nodes.math_block) -> None:
    """Write a formula as MathML, which browsers show themselves: no script, and nothing from elsewhere."""
    block = isinstance(node, nodes.math_block)
    mathml = tex2mathml(node.astext(), as_block=block)
    mathml = re.sub(r"<mo>([⟨⟩])</mo>", r'<mo stretchy="false">\1</mo>', mathml)  # else as tall as their neighbours
    mathml = mathml.replace('<mo stretchy="false">|</mo>', '<mo stretchy="false" lspace="0" rspace="0">|</mo>')
    kept = f'<span class="kept">{mathml}{node.get("stop", "")}</span>'
    translator.body.append(f'<div class="formula">{mathml}</div>' if block else kept)
    raise nodes.SkipNode


def keep_stops(app: Sphinx, document: nodes.document, page: str) -> None:
    """Give each formula in a line the punctuation after it, which would otherwise begin the next line."""
    for node in list(document.findall(nodes.math)):
        after = node.next_node(descend=False, siblings=True)
        if isinstance(after, nodes.Text) and (found := re.match(r"[.,;:)]+", after)):
            node["stop"] = found[0]
            after.parent.replace(after, nodes.Text(after[found.end() :]))


def keep_words(app: Sphinx, document: nodes.document, page: str) -> None:
    """Mark code of short words, which need not break on a narrow page: an option would, at its hyphens."""
    for node in document.findall(nodes.literal):
        if max(map(len, node.astext().split()), default=0) <= LONGEST_WORD:
            node["classes"].append("short")


def run_notebooks(app: Sphinx) -> None:
    """Run the notebook of the paper, where pages are made, after the gallery wrote it and before its pages are read."""
    if app.builder.format == "html":
        notebook.execute(ROOT / "gallery" / "plot_the_paper.ipynb")


def copy_play(app: Sphinx, error: Exception | None) -> None:
    """Copy the live figures, which are a page of their own, beside the pages."""
    if error is None and app.builder.format == "html":
        shutil.copytree(ROOT / "play", app.outdir / "play", ignore=shutil.ignore_patterns("*.py"), dirs_exist_ok=True)
        shutil.copy(ROOT / "play.webp", app.outdir)


def escape_stars(app: Sphinx, context: object, lines: list[str]) -> None:
    """Escape the stars in a command's help, and an underscore before one, which are markup of reStructuredText."""
    lines[:] = [line.replace("*", r"\*").replace(r"_\*", r"\_\*") for line in lines]


def setup(app: Sphinx) -> None:
    """Add what this file defines to Sphinx."""
    app.add_lexer("sh", CommandLexer)
    app.add_html_math_renderer("mathml", (formula, None), (formula, None))
    for part in ("description", "options"):
        app.connect(f"sphinx-click-process-{part}", escape_stars)
    app.connect("doctree-resolved", keep_stops)
    app.connect("doctree-resolved", keep_words)
    app.connect("builder-inited", run_notebooks, priority=900)
    app.connect("build-finished", copy_play)
