"""Kernels inside an FMU are those of the library, to the byte: compiled once for all FMUs of a machine."""

from fmus.builder.recipe import gather, recipe
from fmus.builder.source_bundle import rewrite
from models.catenary.step.engine_choice import KERNEL_FILES
from models.numerics.kernel_cache import joined


def test_the_kernels_of_two_fmus_and_of_the_library_are_one_source(tmp_path):
    sources = {joined(KERNEL_FILES)}
    for package in ("openpanto_0123456789ab", "openpanto_ba9876543210"):
        wanted = recipe("Catenary_LN2")
        inside = {m.path.name: m for m in gather(wanted).modules.values()}
        folder = tmp_path / package
        folder.mkdir()
        for file in KERNEL_FILES:
            text = rewrite(inside[file.name], package, wanted.roots)
            assert file.name == "vector_kernels.py" or package in text
            (folder / file.name).write_text(text, encoding="utf-8")
        sources.add(joined([folder / file.name for file in KERNEL_FILES]))
    assert len(sources) == 1
    assert b"openpanto_" not in sources.pop()
