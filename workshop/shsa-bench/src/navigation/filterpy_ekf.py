"""The extended Kalman filter of odometry.yaml once more, by filterpy, beside what `shsa` makes of the same recording. Prints how
far the two are apart.

    pip install filterpy==1.4.5 rosbags==0.11.9
    shsa replay odometry.yaml husky/test1.bag --output served.jsonl
    python3 filterpy_ekf.py husky/test1.bag served.jsonl
"""

import json
import sys

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter
from rosbags.rosbag1 import Reader
from rosbags.typesys import Stores, get_typestore

WHEELS, GYRO = "/husky_velocity_controller/odom", "/imu/data"
NOISE = np.array([0.03, 0.03, 0.003, 0.55, 0.7])
SAID = {WHEELS: (3, 0.05), GYRO: (4, 0.02)}


def measurements(bag):
    """Time of validity, topic and value, in the order of time."""
    types, found = get_typestore(Stores.ROS1_NOETIC), []
    with Reader(bag) as reader:
        wanted = [connection for connection in reader.connections if connection.topic in SAID]
        for connection, _, raw in reader.messages(wanted):
            message = types.deserialize_ros1(raw, connection.msgtype)
            stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            if connection.topic == WHEELS:
                found.append((stamp - 400_000_000, WHEELS, message.twist.twist.linear.x))
            else:
                found.append((stamp, GYRO, -message.angular_velocity.y))
    return sorted(found, key=lambda one: (one[0], one[1] != WHEELS))


def moved(x, dt):
    """The state after a time, and its derivatives by the state: north, east, heading, speed, turn rate."""
    north, east, heading, speed, rate = x
    middle = heading + rate * dt / 2
    c, s = np.cos(middle), np.sin(middle)
    jacobian = np.eye(5)
    jacobian[0, 2:] = [-speed * dt * s, dt * c, -speed * dt * s * dt / 2]
    jacobian[1, 2:] = [speed * dt * c, dt * s, speed * dt * c * dt / 2]
    jacobian[2, 4] = dt
    return np.array([north + speed * dt * c, east + speed * dt * s, heading + rate * dt, speed, rate]), jacobian


class Rover(ExtendedKalmanFilter):
    def predict_x(self, u=0):
        self.x, _ = moved(self.x, self.dt)

    def advance(self, dt):
        _, self.F = moved(self.x, dt)
        # White noise in a second, gone through the rest of the step: the integral by the trapezium rule.
        half = moved(self.x, dt / 2)[1]
        density = np.diag(NOISE**2)
        self.Q = dt / 6 * (density + 4 * half @ density @ half.T + self.F @ density @ self.F.T)
        self.dt = dt
        self.predict()


def filtered(all_measurements):
    rover = Rover(dim_x=5, dim_z=1)
    rover.x = np.array([0, 0, -0.6, 1, 0], dtype=float)
    rover.P = np.diag([2, 2, 0.3, 1, 1]) ** 2.0
    now, track = all_measurements[0][0], []
    for at, topic, value in all_measurements:
        if at > now:
            rover.advance((at - now) * 1e-9)
            now = at
        place, noise = SAID[topic]
        row = np.eye(5)[place : place + 1]
        rover.update(np.array([value]), lambda _, row=row: row, lambda x, p=place: x[p : p + 1], R=np.array([[noise**2]]))
        track.append((at * 1e-9, rover.x[0], rover.x[1]))
    return np.array(track)


def served(path):
    """The track that was served: north and east at the same times."""
    found = {"/husky/north": [], "/husky/east": []}
    with open(path) as lines:
        for one in map(json.loads, lines):
            value = one["value"]
            middle = (value["lo"] + value["hi"]) / 2 if isinstance(value, dict) else value
            found[one["signal"]].append((one["time_ns"] * 1e-9, middle))
    north, east = (np.array(found[name]) for name in found)
    return np.column_stack([north, np.interp(north[:, 0], east[:, 0], east[:, 1])])


def main(bag, path):
    ours = served(path)
    theirs = filtered(measurements(bag))
    apart = np.hypot(*(ours[:, k] - np.interp(ours[:, 0], theirs[:, 0], theirs[:, k]) for k in (1, 2)))
    driven = np.hypot(np.diff(theirs[:, 1]), np.diff(theirs[:, 2])).sum()
    print(f"{len(ours)} positions over {driven:.1f} m driven: at most {apart.max():.3f} m apart, on average {apart.mean():.4f} m")


main(*sys.argv[1:])
