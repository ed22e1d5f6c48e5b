"""Test the script that writes the outputs of examples into the documentation."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image

from scripts import outputs

PAGE = """# Add

```python
print(1 + 1)
```

It is two.

```toml
# sum.toml
a = 1
```

```bash
sbatch job.sh
```

*Not run: it needs Slurm.*
"""
SHOWN = PAGE.replace("```\n\nIt is", "```\n\n```text\n2\n```\n\nIt is")


@pytest.fixture
def page(tmp_path: Path) -> Path:
    path = tmp_path / "page.md"
    path.write_text(PAGE, "utf-8")
    return path


def run(page: Path) -> list[str]:
    folder = page.parent / "folder"
    folder.mkdir()
    return outputs.run_page(page, folder)


def test_the_output_of_an_example_stands_after_its_block(page: Path) -> None:
    assert outputs.insert_outputs(PAGE, run(page)) == SHOWN


def test_another_output_replaces_the_shown_one(page: Path) -> None:
    assert outputs.insert_outputs(SHOWN.replace("2\n", "3\n"), run(page)) == SHOWN


def test_a_page_with_its_outputs_does_not_change(page: Path) -> None:
    assert outputs.insert_outputs(SHOWN, run(page)) == SHOWN


def test_a_time_or_a_hash_that_differs_is_no_difference() -> None:
    shown = f"mine: 7.5 million agent-steps/s, SHA-256 {'0' * 64}, fitness 3\n"
    measured = f"mine: 21 million agent-steps/s, SHA-256 {'f' * 64}, fitness 3\n"
    page = f"```python\nrun()\n```\n\n```text\n{shown}```\n"
    assert outputs.insert_outputs(page, [measured]) == page
    other = measured.replace("fitness 3", "fitness 4")
    assert outputs.insert_outputs(page, [other]) == page.replace(shown, other)


def test_a_directive_is_not_the_start_of_the_next_example(page: Path) -> None:
    page.write_text("```{exports}\n```\n\n```python\nprint(1)\n```\n", "utf-8")
    assert [block.language for block in outputs.read_blocks(page)] == ["{exports}", "python"]
    assert run(page) == ["", "1\n"]


def test_blocks_are_counted_by_what_they_show(page: Path) -> None:
    assert outputs.count_blocks(page) == {"without": 1, "file": 1, "not run": 1}
    page.write_text(SHOWN, "utf-8")
    assert outputs.count_blocks(page) == {"output": 1, "file": 1, "not run": 1}


def test_a_command_prints_into_the_output_or_into_a_file(page: Path) -> None:
    commands = "baldwinlab list papers\nbaldwinlab show evo/A > a.toml\n"
    page.write_text(f"```console\n{commands}```\n", "utf-8")
    (output,) = run(page)
    assert "le-2019" in output
    assert "[world]" not in output
    assert "[world]" in (page.parent / "folder" / "a.toml").read_text("utf-8")


def test_a_command_that_fails_stops_the_page(page: Path) -> None:
    page.write_text("```console\nbaldwinlab show no-such-preset\n```\n", "utf-8")
    with pytest.raises(AssertionError, match="no-such-preset"):
        run(page)


def test_progress_is_left_out_and_a_long_output_is_cut() -> None:
    lines = [f"line {number}" for number in range(outputs.MAX_LINES + 5)]
    cleaned = outputs.clean("\n".join(["simulating: 100%", *lines])).splitlines()
    assert len(cleaned) == outputs.MAX_LINES
    assert cleaned[0] == "line 0"
    assert cleaned[-1] == "... (6 more lines)"


def test_a_picture_is_read_with_the_file_of_the_example(tmp_path: Path) -> None:
    text = '![Paths](../pictures/paths.png "first/paths.png") and ![a logo](logo.png)'
    assert [*outputs.read_pictures(text)] == [("../pictures/paths.png", "first/paths.png")]
    Image.new("RGB", (2 * outputs.PICTURE_WIDTH, 400), "red").save(tmp_path / "paths.png")
    assert outputs.draw_picture(tmp_path / "paths.png").size == (outputs.PICTURE_WIDTH, 200)
