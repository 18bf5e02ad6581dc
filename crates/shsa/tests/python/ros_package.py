"""Reads the package of ROS 2 as its tools do, but without an installation of ROS.

`catkin_pkg` checks package.xml, by the rules of REP 149. The launch file is carried out with stand-ins for the packages `launch`
and `ament_index_python`, which are not on PyPI: they keep what the file says.

    ros_package.py FOLDER PREFIX '[{ARGUMENT: VALUE, ..}, ..]'
"""

import json
import runpy
import sys
import types
from pathlib import Path

from catkin_pkg.package import parse_package

folder, prefix, launches = Path(sys.argv[1]), sys.argv[2], json.loads(sys.argv[3])


class Said:
    """Keeps what it was made with."""

    def __init__(self, *args, **kwargs):
        self.args, self.kwargs = args, kwargs


class LaunchConfiguration:
    def __init__(self, name):
        self.name = name

    def perform(self, context):
        return context[self.name]


def module(name, **content):
    sys.modules[name] = types.ModuleType(name)
    vars(sys.modules[name]).update(content)


class DeclareLaunchArgument(Said):
    pass


class OpaqueFunction(Said):
    pass


module("launch", LaunchDescription=Said)
module("launch.actions", DeclareLaunchArgument=DeclareLaunchArgument, ExecuteProcess=Said, OpaqueFunction=OpaqueFunction)
module("launch.substitutions", LaunchConfiguration=LaunchConfiguration)
module("ament_index_python")
module("ament_index_python.packages", get_package_prefix=lambda name: prefix,
       get_package_share_directory=lambda name: str(folder))


def carried_out(arguments):
    """The command line that a launch with these arguments starts, or why it does not."""
    actions = runpy.run_path(str(folder / "launch/shsa.launch.py"))["generate_launch_description"]().args[0]
    declared = {it.args[0]: it.kwargs["default_value"] for it in actions if isinstance(it, DeclareLaunchArgument)}
    assert set(arguments) <= set(declared), arguments
    [function] = [it.kwargs["function"] for it in actions if isinstance(it, OpaqueFunction)]
    try:
        [process] = function({**declared, **arguments})
    except RuntimeError as error:
        return str(error)
    return process.kwargs["cmd"]


warnings = []
package = parse_package(folder, warnings=warnings)
package.validate(warnings=warnings)
print(json.dumps({
    "name": package.name, "version": package.version, "format": package.package_format, "warnings": warnings,
    "licenses": list(package.licenses), "build_type": package.get_build_type(),
    "depends": sorted(it.name for it in package.buildtool_depends + package.exec_depends),
    "launches": [carried_out(arguments) for arguments in launches],
}))
