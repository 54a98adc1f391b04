"""Generates the message types from the contract in proto/ when the package is built."""

from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

HERE = Path(__file__).resolve().parent
PROTO = HERE.parent.parent / "proto"
# What a skill exchanges, and what that imports.
FILES = ["kittiwake/v1/skill.proto", "kittiwake/v1/fmu.proto"]


class BuildWithTypes(build_py):
    def run(self):
        from grpc_tools import protoc

        target = HERE / "kittiwake" / "v1"
        target.mkdir(exist_ok=True)
        (target / "__init__.py").touch()
        for name in FILES:
            if protoc.main(["protoc", f"-I{PROTO}", f"--python_out={HERE}", f"--pyi_out={HERE}", str(PROTO / name)]):
                raise SystemExit(f"{name}: no types could be generated")
        super().run()


# Before the packages are looked for: what is generated is one of them.
(HERE / "kittiwake" / "v1").mkdir(exist_ok=True)
(HERE / "kittiwake" / "v1" / "__init__.py").touch()
setup(cmdclass={"build_py": BuildWithTypes}, package_data={"kittiwake.v1": ["*.pyi"]})
