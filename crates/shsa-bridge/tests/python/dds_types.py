"""Messages of ROS 2 as cyclonedds has them, under the names that ROS 2 gives them on DDS."""

from dataclasses import dataclass, field

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import array, float32, float64, int32, sequence, uint8, uint32

def new(kind):
    return field(default_factory=kind)


def zeros(count):
    return field(default_factory=lambda: [0.0] * count)


@final
@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32 = 0
    nanosec: uint32 = 0


@final
@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time = new(Time)
    frame_id: str = ""


@final
@dataclass
class Float64(IdlStruct, typename="std_msgs::msg::dds_::Float64_"):
    data: float64 = 0.0


@final
@dataclass
class Float32(IdlStruct, typename="std_msgs::msg::dds_::Float32_"):
    data: float32 = 0.0


@final
@dataclass
class String(IdlStruct, typename="std_msgs::msg::dds_::String_"):
    data: str = ""


@final
@dataclass
class Range(IdlStruct, typename="sensor_msgs::msg::dds_::Range_"):
    header: Header = new(Header)
    radiation_type: uint8 = 0
    field_of_view: float32 = 0.0
    min_range: float32 = 0.0
    max_range: float32 = 0.0
    range: float32 = 0.0
    variance: float32 = 0.0


@final
@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


@final
@dataclass
class Twist(IdlStruct, typename="geometry_msgs::msg::dds_::Twist_"):
    linear: Vector3 = new(Vector3)
    angular: Vector3 = new(Vector3)


@final
@dataclass
class TwistStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TwistStamped_"):
    header: Header = new(Header)
    twist: Twist = new(Twist)


@final
@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0
    w: float64 = 1.0


@final
@dataclass
class TwistWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::TwistWithCovariance_"):
    twist: Twist = new(Twist)
    covariance: array[float64, 36] = zeros(36)


@final
@dataclass
class TwistWithCovarianceStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TwistWithCovarianceStamped_"):
    header: Header = new(Header)
    twist: TwistWithCovariance = new(TwistWithCovariance)


@final
@dataclass
class Imu(IdlStruct, typename="sensor_msgs::msg::dds_::Imu_"):
    header: Header = new(Header)
    orientation: Quaternion = new(Quaternion)
    orientation_covariance: array[float64, 9] = zeros(9)
    angular_velocity: Vector3 = new(Vector3)
    angular_velocity_covariance: array[float64, 9] = zeros(9)
    linear_acceleration: Vector3 = new(Vector3)
    linear_acceleration_covariance: array[float64, 9] = zeros(9)


@final
@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs::msg::dds_::KeyValue_"):
    key: str = ""
    value: str = ""


@final
@dataclass
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticStatus_"):
    level: uint8 = 0
    name: str = ""
    message: str = ""
    hardware_id: str = ""
    values: sequence[KeyValue] = new(list)


@final
@dataclass
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticArray_"):
    header: Header = new(Header)
    status: sequence[DiagnosticStatus] = new(list)


def name_of(typename):
    """The name that ROS 2 shows: `std_msgs/msg/Float64`."""
    return typename.replace("::dds_", "").replace("::", "/").removesuffix("_")


TYPES = {name_of(it.__idl_typename__): it for it in IdlStruct.__subclasses__() if it.__module__ == __name__}
