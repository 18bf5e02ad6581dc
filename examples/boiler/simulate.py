"""Writes monday.csv and tuesday.csv: a boiler whose supply temperature is measured twice, its flow, and the heat that it delivers.

The supply sensor is off by up to 0.3 K, the display by up to 0.6 degF, the return sensor by 0.3 K, the flow meter by 0.2 l/min, the heat
meter by 0.2 kW. On Tuesday, the display reads 7 degF too much from the 75th minute on.
"""

import datetime
import math
import random

STEP = 10  # seconds


def wander(generator, count, step, back):
    values = [0.0]
    for _ in range(count - 1):
        values.append(values[-1] * (1 - back) + generator.gauss(0, step))
    return values


def write(path, seed, start, fault=None):
    generator = random.Random(seed)
    count = 2 * 3600 // STEP
    valve = wander(generator, count, 0.25, 0.02)
    weather = wander(generator, count, 0.02, 0.002)
    noise = lambda deviation: max(-3.5, min(3.5, generator.gauss(0, 1))) * deviation
    supply = target = 328.0
    with open(path, "w") as file:
        file.write("time,supply [K],display [degF],return [degC],flow [l/min],heat [kW],outside [degC]\n")
        for row in range(count):
            time = row * STEP
            if row % 45 == 0:
                target = 328 + generator.uniform(-7, 7)
            supply += (target - supply) * 0.06
            spread = 8 + 3 * math.sin(time / 1700 + seed) + 0.3 * valve[row]
            flow = 14 + 3 * math.sin(time / 1100 + 2 * seed) + 1.2 * valve[row]
            heat = 4.11 * flow / 60 * spread
            outside = -3 + 4 * math.sin(time / 5000) + weather[row]
            display = 1.8 * (supply - 273.15) + 32 + (7 if fault and time >= fault else 0)
            moment = (start + datetime.timedelta(seconds=time)).strftime("%Y-%m-%dT%H:%M:%SZ")
            file.write(
                f"{moment},{supply + noise(0.08):.2f},{display + noise(0.15):.1f},{supply - spread - 273.15 + noise(0.08):.2f},"
                f"{flow + noise(0.05):.2f},{heat + noise(0.05):.2f},{outside + noise(0.05):.1f}\n"
            )


write("monday.csv", 1, datetime.datetime(2026, 2, 9, 6))
write("tuesday.csv", 2, datetime.datetime(2026, 2, 10, 6), fault=4500)
