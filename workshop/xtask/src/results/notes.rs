//! The text between the tables: how to read them, and which faults are not detected, and why.

pub(super) const HEAD: &str = "\
# Results

What `shsa replay` finds in real recordings, clean and with injected faults. `cargo xtask results` writes this file: it
replays everything again and takes each figure from the run; the last section has a command of its own. The recordings are third-party ones and no part of this
project; they are expected beside it, in `../shared/data`.

In the tables, *verdict* is the verdict on the signal with the fault: `failed` or `silent` isolates it, `suspected` means
that others explain the evidence as well; *after* is the time from the start of the fault to this event. *Others suspected*
and *others failed* are all other signals with this verdict at any time until the end of the recording. *Longest gap*
and *rmse* are about the need that the signal can serve: the longest time between two published values, and the error
against the run without the fault. A signal that failed once may be trusted again while its fault does not show (a scale
error at rest), so a row has the first verdict.
";

pub(super) const CLEAN: &str = "
The events of the motes are those of the two labelled events of this recording: see the last section.
";

pub(super) const CAR: &str = "
Each fault is named alone. A value that sticks is found only once the car brakes, for which it takes 1.2 s to differ by
more than the tolerances. A signal is silent after its time-out, 0.4 s for a wheel and 0.9 s for the GNSS; values of other
ways fill in after half the time that the need allows, so the need does not wait for the verdict. What remains as rmse is
the difference between two healthy wheels.

Not detected: a bias below about 1.2 m/s at a wheel or 0.8 m/s at the GNSS, a scale error that stays below these at the
present speed, any fault without an error (`spoof=0` at a standstill). These are the tolerances that bumps, curves and
the delay of the receiver need.
";

pub(super) const PAIRS: &str = "
Two wheels with the same bias agree with each other, and two against three are still isolated, because the GNSS is the
third. It takes longer than one fault does: the GNSS compares ten times a second, and nobody is named while its comparisons
may yet change the answer.

All kinds with all kinds, on all pairs, the second fault 0, 0.1, 0.5 or 10 s after the first:

";

pub(super) const GRID: &str = "
*Not isolated* is a run in which both faulty signals are accused, but at least one is only suspected; *missed* one in which
a faulty signal is never accused. Healthy signals are suspected where two faults grow slowly, together and apart from the
rest (`stuck`): for a moment two wheels against two, with a GNSS that agrees with all four. A healthy one is never
called failed.
";

pub(super) const QUAD: &str = "
Units are those of the signals; rmse is in m/s for velocities, m for the height, V for the cells.

Not detected, late, or not isolated:

- A velocity is compared with the mean of the position's change over 2 s, so a fault shows when it has moved this mean by
  0.6 m/s. Noise averages out there; it is found by values that change too fast.
- A vertical speed that sticks or is spoofed with 0 in level flight has no error until the landing. Its only witness is the
  barometer, over 3 s and within 1.5 m/s, because the rotors' wash disturbs it near the ground: a bias of 1 m/s is within that error,
  and is detected late, by many comparisons together; a scale of 1.3 is detected while it climbs or sinks quickly.
- The total speed is computed from the three velocities. So it is no witness for them, only against them: when it alone is
  wrong, one of the four must be faulty, and none is isolated.
- Height and vertical speed have only each other: both are suspected, and the need `height` has no other source. A jump
  below 4.8 m stays within what the barometer may do in 3 s.
- A jump of the position shows for the two seconds that the window holds it; a fault of the latitude or longitude is suspected
  together with the velocity that it contradicts.
- A cell that sticks or drifts is found when it has left the others by 0.14 V; the discharge takes two minutes for that. With
  two cells at opposite ends of the spread, both are suspected first. The pack's voltage against four cells: 1 V and more.
- Current and charge have only each other, over 120 s and within 3 A and 5 %: both are suspected, noise averages out, and a
  current that sticks at what the flight needs on average is not seen.
";

pub(super) const HUSKY: &str = "
Rmse is in rad/s for the yaw rate, m/s for the path's speed.

Not detected, late, or not isolated:

- The odometry's twist is the difference of its own pose over a second: it is declared as derived, and as a mean over that second.
  So the yaw rate has two independent witnesses only, the inertial unit and the pose, and when they disagree either may be faulty.
  All are suspected then, and the need has no trusted source: the long gaps. When one of them is silent, the other takes over.
- Biases below about 0.1 rad/s of the inertial unit or of the twist stay within the tolerances. A value that sticks, or is
  spoofed with 0, has no error while the rover stands still.
- The length of the quaternion shows a faulty heading at once, but does not isolate one of its two numbers. The accusation waits for
  the satellites, over 2 s, as the path of a bend is computed from the heading as well.
- A jump of a position shows only for as long as the window holds it.
- The satellites' track is rough: within 1.2 m/s over 2 s. A receiver that sticks at 1 m/s or less is not seen.
";

pub(super) const MOTES: &str = "
Two motes in a room cannot say which of them lies: both are suspected, and neither is called failed. Humidity shows both
events first. The needs of these models allow a value to be an hour old: motes 1 and 2 were recorded for 52 minutes less
than the others, and that end of a file is no fault.
";

pub(super) const CHAOS: &str = "\
`cargo xtask chaos` writes this section: it runs the tests `crates/shsa/tests/chaos` one after another, with Mosquitto,
Zenoh routers and Python clients that know nothing of `shsa`. The same tests are part of CI. A row is written only when its
promise was kept. Three wheels measure one speed 50 times a second; a consumer reads the need, and the *longest
gap* is the longest time that it had no value. Times are measured, so they differ from run to run. *Wrong* is a value that was off
by more than errors and rates allow when it was measured, *old* one that nothing was like in the last two seconds; every value tells in its
last decimals when it was measured. Random sequences are drawn from seeds, one false sensor at a time: `SHSA_SEEDS=1..100 cargo xtask
chaos` runs those of a hundred.

";
