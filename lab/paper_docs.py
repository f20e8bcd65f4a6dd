# SPDX-License-Identifier: Apache-2.0
"""Copies the tables of `lab reproduce` into docs/papers.md and lab/records/papers_tables.md.

  python3 -m lab paper_docs RESULTS_DIR [--root DIR]

RESULTS_DIR holds the output folders of `lab reproduce` under the names used in the documents. The text between
`<!-- table: FOLDER/NAME -->` and `<!-- end of table -->` is replaced by the table NAME of a .md file in RESULTS_DIR/FOLDER,
the text between `<!-- file: FOLDER/FILE -->` and `<!-- end of file -->` by that file. Parts whose folder is missing are kept.
"""
import re
from pathlib import Path

from lab import core

PAGES = ("docs/papers.md", "lab/records/papers_tables.md")
TABLE = re.compile(r"<!-- table: (?P<name>\S+) -->\n(?P<text>.*?)<!-- end of table -->", re.DOTALL)
FILE = re.compile(r"<!-- file: (?P<name>\S+) -->\n(?P<text>.*?)<!-- end of file -->", re.DOTALL)


def add_arguments(parser):
    parser.add_argument("results", type=Path, metavar="RESULTS_DIR")
    parser.add_argument("--root", type=Path, default=core.ROOT, help="folder of the repository")


def table_of(results, name):
    """The text of a table; None if its folder is missing."""
    folder, table = name.split("/", 1)
    if not (results / folder).exists():
        return None
    for file in sorted((results / folder).glob("*.md")):
        for found in TABLE.finditer(file.read_text(encoding="utf-8")):
            if found["name"] == table:
                return found["text"]
    raise core.Failed(f"{results / folder} has no table '{table}'")


def file_of(results, name):
    """The text of a file, with its title as a section heading; None if its folder is missing."""
    if not (results / name).parent.exists():
        return None
    return re.sub("^# ", "## ", (results / name).read_text(encoding="utf-8"))


def pasted(text, results):
    """The document with the tables and files of the results."""
    def replaced(pattern, kind, read):
        def new(found):
            content = read(results, found["name"])
            content = found["text"] if content is None else "\n" + content.strip("\n") + "\n\n"
            return f"<!-- {kind}: {found['name']} -->\n{content}<!-- end of {kind} -->"
        return lambda document: pattern.sub(new, document)
    return replaced(FILE, "file", file_of)(replaced(TABLE, "table", table_of)(text))


def main(arguments):
    if not arguments.results.is_dir():
        raise core.Failed(f"there is no folder {arguments.results}")
    for page in PAGES:
        document = arguments.root / page
        text = document.read_text(encoding="utf-8")
        new = pasted(text, arguments.results)
        if new != text:
            document.write_text(new, encoding="utf-8")
            print(f"changed {document}")
    return 0
