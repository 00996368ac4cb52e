"""A page of Markdown as one HTML file that fetches nothing: pictures inside, tables that scroll, contents from its headings."""

import base64
import html
import re
from collections.abc import Sequence
from pathlib import Path

import jinja2
from markdown_it import MarkdownIt
from markdown_it.token import Token

from virtual_soil.campaign.files import write_text

TEMPLATES = jinja2.Environment(loader=jinja2.FileSystemLoader(Path(__file__).parent), autoescape=True)


def write_html(source: str | Path, target: str | Path) -> None:
    """Write a Markdown file as HTML; its links to PNG files count from its folder.

    Raises OSError if a picture is missing, and the errors of `campaign.files.write_text`.
    """
    source = Path(source)
    reader = MarkdownIt("commonmark", {"html": False}).enable("table")
    tokens = reader.parse(source.read_text(encoding="utf-8"))
    title, links = headings(tokens)
    frame_tables(tokens)
    embed_pictures(tokens, source.parent)
    body = reader.renderer.render(tokens, reader.options, {})
    write_text(target, TEMPLATES.get_template("markdown.html.j2").render(title=title, links=links, body=body))


def headings(tokens: Sequence[Token]) -> tuple[str, dict[str, str]]:
    """Text of the first heading, and anchor -> text of those below it, which get their anchors."""
    title, links = "", {}
    for token, content in zip(tokens, tokens[1:], strict=False):
        if token.type != "heading_open":
            continue
        if token.tag == "h1" and not title:
            title = content.content
        elif token.tag == "h2":
            anchor = re.sub(r"[^a-z0-9]+", "-", content.content.lower()).strip("-")
            token.attrSet("id", anchor)
            links[anchor] = content.content
    return title, links


def frame_tables(tokens: Sequence[Token]) -> None:
    """Let every table scroll in a frame that the keyboard reaches, named by the heading above it."""
    above, number = "", 0
    for k, token in enumerate(tokens):
        if token.type == "heading_open":
            above = tokens[k + 1].content
        elif token.type == "table_open":
            number += 1
            name = html.escape(f"Table {number}, {above}")
            raw(token, f'<div class="scroll" role="group" tabindex="0" aria-label="{name}"><table>\n')
        elif token.type == "table_close":
            raw(token, "</table></div>\n")


def embed_pictures(tokens: Sequence[Token], folder: Path) -> None:
    """Put the pictures of PNG files into the page."""
    for token in tokens:
        for child in token.children or []:
            if child.type == "image":
                data = base64.b64encode((folder / str(child.attrs["src"])).read_bytes()).decode()
                words = html.escape(child.content)
                raw(child, f'<span class="still"><img src="data:image/png;base64,{data}" alt="{words}"></span>')


def raw(token: Token, text: str) -> None:
    """Turn a token into HTML as it stands."""
    token.type, token.content = "html_block", text
