"""A block diagram in a browser: a click shows what is in a part, another leads back."""

from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import ConstantVectorSource, Gain
from sheldrake.visualization import DrawDiagram


def test_a_click_leads_into_a_part_and_back(chromium, tmp_path, pictures):
    inside = DiagramBuilder()
    gain = inside.AddNamedSystem("gain", Gain(2.0, 1))
    inside.ExportInput(gain.get_input_port(), "u")
    inside.ExportOutput(gain.get_output_port(), "y")
    builder = DiagramBuilder()
    part = inside.Build()
    part.set_name("part")
    builder.AddSystem(part)
    source = builder.AddNamedSystem("source", ConstantVectorSource([1.0]))
    builder.Connect(source.get_output_port(), part.get_input_port())
    whole = builder.Build()
    whole.set_name("whole")
    file = tmp_path / "whole.svg"
    DrawDiagram(whole, file)
    page = chromium.open(file.as_uri())

    def shown(name):
        text = f"[...document.querySelectorAll('text')].find((t) => t.textContent === '{name}')"
        return f"((t) => !!t && t.getBoundingClientRect().width > 0)({text})"

    def link(name):
        return f"[...document.querySelectorAll('a')].find((a) => a.textContent.includes('{name}'))"

    page.wait_for(f"{shown('source')} && !{shown('gain')}")
    page.screenshot(pictures, "block-diagram.png")
    page.click_on(link("part"))
    page.wait_for(f"{shown('gain')} && !{shown('source')}")
    page.click_on(link("whole"))
    page.wait_for(f"{shown('source')} && !{shown('gain')}")
