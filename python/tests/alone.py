"""Without any other package: models, engines, and replays of files."""

import sys

import shsa

for absent in ("pandas", "pyarrow", "numpy", "pyspark", "asyncua"):
    assert absent not in sys.modules
    try:
        __import__(absent)
    except ImportError:
        continue
    raise AssertionError(f"{absent} is here: the environment is not clean")

car = shsa.Model.load("examples/car.yaml")
drive = shsa.replay(car, "examples/monday")
assert drive.report["needs"]["speed"]["met"], drive.report

try:
    import shsa.opcua
except ImportError as error:
    assert "pip install 'shsa[opcua]'" in str(error), error
else:
    raise AssertionError("asyncua is not needed")
