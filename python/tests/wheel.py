"""Puts a wheel together as maturin does, of a library that is built already: wheel.py LIBRARY FOLDER. Prints its path."""

import base64
import hashlib
import pathlib
import sys
import tomllib
import zipfile

here = pathlib.Path(__file__).parent.parent
library, folder = map(pathlib.Path, sys.argv[1:])
project = tomllib.loads((here / "pyproject.toml").read_text())["project"]
version = tomllib.loads((here / "../Cargo.toml").read_text())["workspace"]["package"]["version"]
folder.mkdir(parents=True, exist_ok=True)
path = folder / f"shsa-{version}-cp310-abi3-linux_x86_64.whl"

files = {f"shsa/{file.name}": file.read_bytes() for file in sorted((here / "package/shsa").glob("*.*"))}
files["shsa/_shsa.abi3.so"] = library.read_bytes()
info = f"shsa-{version}.dist-info"
files[f"{info}/METADATA"] = (
    f"Metadata-Version: 2.4\nName: shsa\nVersion: {version}\nRequires-Python: {project['requires-python']}\n".encode()
)
files[f"{info}/WHEEL"] = b"Wheel-Version: 1.0\nRoot-Is-Purelib: false\nTag: cp310-abi3-linux_x86_64\n"


def digest(content: bytes) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()


lines = [f"{name},sha256={digest(content)},{len(content)}" for name, content in files.items()]
files[f"{info}/RECORD"] = "\n".join([*lines, f"{info}/RECORD,,\n"]).encode()
with zipfile.ZipFile(path, "w") as wheel:
    for name, content in files.items():
        wheel.writestr(name, content)
print(path)
