"""Starts `shsa run`: `ros2 launch shsa shsa.launch.py model:=/path/to/model.yaml`."""

import os

import yaml
from ament_index_python.packages import get_package_prefix, get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.substitutions import LaunchConfiguration

PACKAGE = "shsa"
# Each is an option of `shsa run`, but for the model.
ARGUMENTS = {
    "model": "the model, or several with `,` between",
    "bus": "ros2-dds, ros2-dds://INTERFACE, ros2, ros2://HOST:PORT, or a bus that is not of ROS",
    "name": "the name of the instance",
    "http": "the address of HTTP and the live page, or off",
    "state": "the folder for what outlasts a restart",
    "journal": "the folder of the journal",
}


def parameters(path):
    """The parameters in a file of ROS 2."""
    with open(path, encoding="utf-8") as file:
        return (yaml.safe_load(file) or {}).get(PACKAGE, {}).get("ros__parameters", {})


def program():
    """The command of this package where it was built with it, else the one on the PATH."""
    own = os.path.join(get_package_prefix(PACKAGE), "lib", PACKAGE, "shsa")
    return own if os.access(own, os.X_OK) else "shsa"


def command_line(values):
    """The command with its arguments; what is empty is not given."""
    models = [model for model in str(values.get("model") or "").split(",") if model]
    if not models:
        raise RuntimeError("no model: write model:=/path/to/model.yaml, or put it into the file of params_file")
    # YAML reads `off` as a truth value.
    values = {name: "off" if value is False else value for name, value in values.items()}
    given = [name for name in ARGUMENTS if name != "model" and values.get(name)]
    return [program(), "run", *models, *(word for name in given for word in (f"--{name}", str(values[name])))]


def start(context):
    given = {name: LaunchConfiguration(name).perform(context) for name in ["params_file", *ARGUMENTS]}
    values = parameters(given.pop("params_file"))
    values.update({name: value for name, value in given.items() if value != ""})
    return [ExecuteProcess(cmd=command_line(values), name=PACKAGE, output="screen")]


def generate_launch_description():
    usual = os.path.join(get_package_share_directory(PACKAGE), "config", "shsa.yaml")
    return LaunchDescription([
        DeclareLaunchArgument("params_file", default_value=usual, description="the file of the parameters"),
        *(DeclareLaunchArgument(name, default_value="", description=what) for name, what in ARGUMENTS.items()),
        OpaqueFunction(function=start),
    ])
