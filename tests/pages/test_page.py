"""Pages: what a drawing may bring along, what becomes of what is too large, and that names stay text."""

import numpy as np
import pytest

from bowdenfit.pages.chart import Chart, Group, Series
from bowdenfit.pages.drawing import inline
from bowdenfit.pages.page import MOST_BYTES, TOO_LARGE, render
from bowdenfit.pages.section import Page, Picture, Table, prose

SVG = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="0 0 9 9">{}</svg>'


@pytest.mark.parametrize(
    "hostile",
    [
        "<script>alert(1)</script>",
        '<foreignObject><body xmlns="http://www.w3.org/1999/xhtml" onload="alert(1)"/></foreignObject>',
        '<rect onclick="alert(1)"/>',
        '<a xlink:href="javascript:alert(1)"><rect/></a>',
        '<image xlink:href="https://example.org/seen.png"/>',
        '<rect style="fill: url(https://example.org/seen.svg#a)"/>',
        '<rect style="background: \\75rl(https://example.org)"/>',
        "<style>@import url(https://example.org/a.css);</style>",
        '<use xlink:href="other.svg#a"/>',
        "<text>&lt;script&gt;alert(1)&lt;/script&gt;</text>",
    ],
)
def test_nothing_in_a_drawing_acts_or_is_fetched(hostile):
    found = inline(SVG.format(hostile), "d0-", "words")
    for trace in ("<script", "onload", "onclick", "javascript", "example.org", "other.svg", "@import", "foreignObject"):
        assert trace not in found


def test_a_drawing_keeps_what_it_draws_with_names_of_its_own():
    drawn = (
        '<defs><clipPath id="p"><rect x="1.23456" y="0"/></clipPath><path id="m" d="M 0 0 L 1.000001 2"/></defs>'
        '<g id="unused"><g clip-path="url(#p)"><use xlink:href="#m" x="1"/></g><text>a &lt; b\u202e</text></g>'
    )
    found = inline(SVG.format(drawn), "d7-", 'the "words"')
    assert 'aria-label="the &quot;words&quot;"' in found
    assert 'id="d7-0"' in found
    assert 'clip-path="url(#d7-' in found
    assert 'href="#d7-' in found
    assert 'x="1.23"' in found
    assert 'd="M 0 0 L 1 2"' in found
    assert "unused" not in found
    assert "a &lt; b\\u202e" in found


def test_a_damaged_drawing_is_said_to_be():
    with pytest.raises(ValueError, match="a drawing is damaged"):
        inline("<svg><g></svg>", "d0-", "")


def test_drawings_for_which_there_is_no_room_are_left_out_and_that_is_said():
    text = SVG.format("<text>" + "x" * (MOST_BYTES // 2) + "</text>")
    pictures = tuple(Picture(name, "Words", "More.") for name in ("one", "two", "three"))
    page = render(Page("a", "b", (prose("Figures", (), pictures=pictures),)), {"one": text, "two": text})
    assert page.count("<svg") == 1
    assert page.count(TOO_LARGE) == 1
    assert "figure-three" not in page
    assert len(page.encode()) < 1_500_000


def test_a_page_carries_scripts_only_for_its_charts_and_then_the_terms_of_their_library():
    chart = Chart("a", "x", "y", (Group(np.arange(2.0), (Series("b", "line", "blue", np.arange(2.0)),)),))
    with_chart, without = (
        render(Page("a", "b", (prose("F", (), pictures=(Picture("one", "T", "C.", of),)),)), {"one": SVG.format("")})
        for of in ((chart,), ())
    )
    assert "Copyright (c) 2022 Leon Sorokin" in with_chart
    assert with_chart.count("sha256-") == 2
    assert "<script" not in without
    assert "script-src &#39;none&#39;" in without


def test_names_stay_text_wherever_they_stand():
    odd = "</script><b>'\"\u202e{{ 1 }}"
    chart = Chart(odd, odd, odd, (Group(np.arange(2.0), (Series(odd, "line", "blue", np.array([1.0, np.nan])),)),))
    section = prose(
        odd, [odd], [Table((odd,), ((odd,),), odd)], [odd], [(odd, odd)], (Picture("one", odd, odd, (chart,)),)
    )
    page = render(Page(odd, odd, (section,)), {"one": SVG.format("")})
    assert "<b>" not in page
    assert "\u202e" not in page
    assert page.count("</script>") == 3
    assert "null" in page
