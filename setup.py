"""Build the package with the FMUs' loader compiled, where that is possible; everything else is in pyproject.toml.

A wheel that holds the loader runs under every Python 3 on Linux x86-64 with a glibc that is new enough, and is tagged
so. Elsewhere, or without a compiler, the wheel is pure: there the loader is compiled when an FMU is built, or FMUs
get pythonfmu's own library.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

from setuptools import setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_py import build_py

HERE = Path(__file__).resolve().parent


def loader_build() -> ModuleType:
    """Return the module that compiles the loader, without the packages that the others need."""
    spec = importlib.util.spec_from_file_location("loader_build", HERE / "fmus" / "loader" / "loader_build.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class BuildWithLoader(build_py):
    """Compile the loader beside its sources in the built package."""

    def run(self) -> None:
        """Build the package; without a compiler, without the loader, and say so."""
        super().run()
        if self.editable_mode:
            return  # compiled when an FMU is built, from the sources as they then are
        maker = loader_build()
        library = Path(self.build_lib) / "fmus" / "loader" / maker.built_name()
        try:
            maker.compile_loader(library)
        except maker.LoaderError as error:
            print(f"note: the package is built without the FMUs' loader: {error}", file=sys.stderr)


class TaggedWheel(bdist_wheel):
    """Tag the wheel for what the loader in it runs on."""

    def run(self) -> None:
        """Build the package first, for on it the tag depends."""
        self.run_command("build_py")
        super().run()

    def get_tag(self) -> tuple[str, str, str]:
        """Return the tags of interpreter, ABI and platform."""
        maker = loader_build()
        library = Path(self.get_finalized_command("build_py").build_lib) / "fmus" / "loader" / maker.built_name()
        if not library.is_file():
            return "py3", "none", "any"
        needed = maker.needed_versions(library.read_bytes())["GLIBC"]
        major, minor = max(needed, maker.OLDEST_GLIBC)[:2]
        return "py3", "none", f"manylinux_{major}_{minor}_x86_64"


setup(cmdclass={"build_py": BuildWithLoader, "bdist_wheel": TaggedWheel})
