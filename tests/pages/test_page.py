"""Pages: how a drawing is held, what becomes of what is too large, and that names stay text."""

import io

import numpy as np
import pytest
from PIL import Image

from bowdenfit.pages.page import MOST_BYTES, TOO_LARGE, render_page
from bowdenfit.pages.section import Chart, HtmlPage, PageTable, Picture, Series, SeriesGroup, prose_section


def png(size=0):
    """A picture of one red dot, with so many bytes more behind its end."""
    file = io.BytesIO()
    Image.new("RGB", (1, 1), "red").save(file, "png")
    return file.getvalue() + b"x" * size


def test_a_drawing_is_held_by_the_page_in_the_size_in_which_it_was_drawn():
    file = io.BytesIO()
    Image.new("RGB", (1120, 480)).save(file, "png", dpi=(160, 160))
    page = render_page(
        HtmlPage("a", "b", (prose_section("F", (), pictures=(Picture("one", 'the "words"', "C."),)),)),
        {"one": file.getvalue()},
    )
    assert '<img class="wide" width="672" height="288" alt="the &quot;words&quot;" src="data:image/png;base64,iVBOR' in page


def test_a_damaged_drawing_is_said_to_be():
    with pytest.raises(ValueError, match="its file is no PNG"):
        render_page(HtmlPage("a", "b", (prose_section("F", (), pictures=(Picture("one", "T", "C."),)),)), {"one": b"<svg/>"})


def test_drawings_for_which_there_is_no_room_are_left_out_and_that_is_said():
    large = png(3 * MOST_BYTES // 8)
    pictures = tuple(Picture(name, "Words", "More.") for name in ("one", "two", "three"))
    page = render_page(HtmlPage("a", "b", (prose_section("Figures", (), pictures=pictures),)), {"one": large, "two": large})
    assert page.count("<img") == 1
    assert page.count(TOO_LARGE) == 1
    assert "figure-three" not in page
    assert len(page.encode()) < MOST_BYTES


def test_a_page_carries_scripts_only_for_its_charts_and_then_the_terms_of_their_library():
    chart = Chart("a", "x", "y", (SeriesGroup(np.arange(2.0), (Series("b", "line", "blue", np.arange(2.0)),)),))
    with_chart, without = (
        render_page(HtmlPage("a", "b", (prose_section("F", (), pictures=(Picture("one", "T", "C.", of),)),)), {"one": png()})
        for of in ((chart,), ())
    )
    assert "Copyright (c) 2022 Leon Sorokin" in with_chart
    assert with_chart.count("sha256-") == 2
    assert "<script" not in without
    assert "script-src 'none'" in without


def test_names_stay_text_wherever_they_stand():
    odd = "</script><b>'\"\u202e{{ 1 }}"
    chart = Chart(odd, odd, odd, (SeriesGroup(np.arange(2.0), (Series(odd, "line", "blue", np.array([1.0, np.nan])),)),))
    section = prose_section(
        odd, [odd], [PageTable((odd,), ((odd,),), odd)], [odd], [(odd, odd)], (Picture("one", odd, odd, (chart,)),)
    )
    page = render_page(HtmlPage(odd, odd, (section,)), {"one": png()})
    assert "<b>" not in page
    assert "\u202e" not in page
    assert page.count("</script>") == 2
    assert "null" in page
