# SPDX-License-Identifier: BSD-3-Clause
"""Pages that need no other file."""

from html.parser import HTMLParser

from hive_common import html_page


class Seen(HTMLParser):
    """What a browser would find."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.texts, self.sources = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.sources += [value for name, value in attrs if name in {"src", "href"}]

    def handle_data(self, data):
        self.texts += [data.strip()] * bool(data.strip())


def test_what_is_written_is_shown_as_it_stands_and_never_as_html():
    bad = "<script>alert('x')</script> & co"

    seen = Seen(
        html_page.page(
            bad,
            bad,
            [html_page.heading(bad), html_page.table([bad], [[bad]]), html_page.listing(bad, bad)],
        )
    )

    assert "script" not in seen.tags
    assert seen.texts.count(bad) == 8


def test_a_picture_is_a_part_of_the_page(tmp_path):
    (tmp_path / "a.png").write_bytes(b"\x89PNG")

    seen = Seen(html_page.page("t", "f", [html_page.picture("a robot", tmp_path / "a.png")]))

    assert seen.sources == ["data:image/png;base64,iVBORw=="]


def test_marked_rows_stand_out():
    text = html_page.table(["task"], [["T1"], ["T2"]], frozenset({1}))

    assert text.count('class="marked"') == 1
    assert '<tr class="marked"><td>T2</td></tr>' in text
