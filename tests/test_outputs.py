"""Files appear whole or not at all, and what cannot be written is found beforehand."""

import os
from pathlib import Path

import pytest
from refusals import refuses

from stickslip.outputs import check_output, files_at_once, whole_file


def test_a_file_appears_under_its_name_only_when_complete(tmp_path: Path) -> None:
    target = tmp_path / "result.json"
    with whole_file(target) as stream:
        stream.write("half")
        assert not target.exists()
        stream.write(" and half")
    assert target.read_text() == "half and half"
    assert list(tmp_path.iterdir()) == [target]


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    target = tmp_path / "result.json"
    target.write_text("old")

    def fail_half_way() -> None:
        with whole_file(target) as stream:
            stream.write("half")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail_half_way()
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_files_that_belong_together_appear_all_or_none(tmp_path: Path) -> None:
    (tmp_path / "b.txt").mkdir()  # stands where the second file shall go

    def write_both() -> None:
        with files_at_once(tmp_path) as scratch:
            for name in ("a.txt", "b.txt"):
                (scratch / name).write_text("new")

    with refuses("output_failed", reason="it is a folder"):
        write_both()
    assert [path.name for path in tmp_path.iterdir()] == ["b.txt"]


def test_the_check_leaves_no_trace(tmp_path: Path) -> None:
    check_output(tmp_path / "result.json")
    assert list(tmp_path.iterdir()) == []


def test_a_long_name_still_has_room_for_its_partial_file(tmp_path: Path) -> None:
    target = tmp_path / ("x" * 250 + ".json")
    check_output(target)
    with whole_file(target) as stream:
        stream.write("1")
    assert target.read_text() == "1"


@pytest.mark.parametrize(
    ("place", "code"),
    [
        ("", "output_is_folder"),
        ("missing/result.json", "output_without_folder"),
        ("file/result.json", "output_without_folder"),
        ("x" * 300, "output_failed"),
    ],
)
def test_places_where_nothing_can_be_written(place: str, code: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with refuses(code):
        check_output(tmp_path / place)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write anywhere")
def test_protected_folders_and_files_are_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "file").chmod(0o444)
    with refuses("output_failed", reason="the file is write-protected"):
        check_output(tmp_path / "file")
    tmp_path.chmod(0o555)
    with refuses("output_failed", reason="Permission denied"):
        check_output(tmp_path / "other")


def test_an_input_is_not_overwritten_under_any_name(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text("1")
    (tmp_path / "alias.csv").symlink_to(log)
    for name in ("log.csv", "alias.csv", "../" + tmp_path.name + "/log.csv"):
        with refuses("output_is_input"):
            check_output(tmp_path / name, inputs=[log])


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full on this system")
def test_a_full_disk_is_said_so() -> None:
    full = Path("/dev/full")
    check_output(full)
    with refuses("output_failed", reason="No space left on device"), whole_file(full) as stream:
        stream.write("x")


def test_several_files_appear_together(tmp_path: Path) -> None:
    folder = tmp_path / "a" / "b"
    with files_at_once(folder) as scratch:
        for name in ("one", "two"):
            (scratch / name).write_text(name)
        assert [path.is_dir() for path in folder.iterdir()] == [True]
    assert {path.name: path.read_text() for path in folder.iterdir()} == {
        "one": "one",
        "two": "two",
    }


def test_a_failure_takes_all_of_several_files_back(tmp_path: Path) -> None:
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "one").write_text("old")

    def fail_half_way(folder: Path) -> None:
        with files_at_once(folder) as scratch:
            (scratch / "one").write_text("new")
            raise ZeroDivisionError

    for folder in (tmp_path / "old", tmp_path / "new" / "deep"):
        with pytest.raises(ZeroDivisionError):
            fail_half_way(folder)
    assert [path.name for path in tmp_path.iterdir()] == ["old"]
    assert {path.name: path.read_text() for path in (tmp_path / "old").iterdir()} == {"one": "old"}


def test_several_files_need_a_folder_to_go_to(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("kept")
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        with (
            refuses("output_needs_folder"),
            files_at_once(folder),
        ):
            pass
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
