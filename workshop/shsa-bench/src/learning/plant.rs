//! A recording to draft and to learn from: machines of 20 signals each, some of which are related.

use shsa_lab::calibration::Chance;
use std::f64::consts::TAU;
use std::io::{self, BufWriter, Write};

/// The size of the recording.
#[derive(Clone, Copy)]
pub(super) struct Size {
    pub(super) signals: usize,
    /// Rows a second.
    pub(super) rate: u32,
    pub(super) rows: u32,
}

/// Sines that a wave is made of, and its slowest and its fastest one in hertz.
const SINES: usize = 6;
const SLOWEST_HZ: f64 = 0.003;
const FASTEST_HZ: f64 = 0.05;

/// Waves of a machine.
const WAVES: usize = 12;

/// A slow random movement with a mean of 0 and a standard deviation of 1.
struct Wave([Sine; SINES]);

#[derive(Clone, Copy)]
struct Sine {
    size: f64,
    radians_per_s: f64,
    phase: f64,
}

impl Wave {
    fn new(chance: &mut Chance) -> Wave {
        let size = (2.0 / SINES as f64).sqrt();
        let mut sine = |_| Sine {
            size,
            radians_per_s: TAU * SLOWEST_HZ * (FASTEST_HZ / SLOWEST_HZ).powf(chance.share()),
            phase: TAU * chance.share(),
        };
        Wave([0; SINES].map(&mut sine))
    }

    fn at(&self, time_s: f64) -> f64 {
        self.0.iter().map(|it| it.size * (it.radians_per_s * time_s + it.phase).sin()).sum()
    }

    fn integral(&self, time_s: f64) -> f64 {
        let of = |it: &Sine| -it.size / it.radians_per_s * (it.radians_per_s * time_s + it.phase).cos();
        self.0.iter().map(of).sum()
    }
}

/// The movements of one machine.
struct Machine([Wave; WAVES]);

impl Machine {
    fn wave(&self, number: usize, time_s: f64) -> f64 {
        self.0.get(number).map_or(0.0, |wave| wave.at(time_s))
    }

    fn speed(&self, time_s: f64) -> f64 {
        12.0 + 3.0 * self.wave(0, time_s)
    }

    fn voltage(&self, time_s: f64) -> f64 {
        48.0 + 2.0 * self.wave(1, time_s)
    }

    fn current(&self, time_s: f64) -> f64 {
        10.0 + 3.0 * self.wave(2, time_s)
    }

    fn shaft(&self, time_s: f64) -> f64 {
        100.0 + 20.0 * self.wave(3, time_s)
    }

    fn gear(&self, time_s: f64) -> f64 {
        (2.0 + 1.2 * self.wave(4, time_s)).round().clamp(1.0, 3.0)
    }

    fn inflow(&self, time_s: f64) -> f64 {
        30.0 + 8.0 * self.wave(5, time_s)
    }

    fn outflow(&self, time_s: f64) -> f64 {
        20.0 + 5.0 * self.wave(6, time_s)
    }

    fn temperature(&self, time_s: f64) -> f64 {
        60.0 + 6.0 * self.wave(7, time_s)
    }
}

/// One signal of each machine.
struct Column {
    name: &'static str,
    unit: &'static str,
    noise: f64,
    value: fn(&Machine, f64) -> f64,
}

const COLUMNS: [Column; 20] = [
    Column { name: "speed_1", unit: "m/s", noise: 0.03, value: Machine::speed },
    Column { name: "speed_2", unit: "m/s", noise: 0.05, value: Machine::speed },
    Column { name: "way", unit: "m", noise: 0.02, value: |it, at| 12.0 * at + 3.0 * it.0[0].integral(at) },
    Column { name: "late_speed", unit: "m/s", noise: 0.03, value: |it, at| it.speed(at - 0.7) },
    Column { name: "voltage", unit: "V", noise: 0.02, value: Machine::voltage },
    Column { name: "current", unit: "A", noise: 0.03, value: Machine::current },
    Column { name: "power", unit: "W", noise: 1.0, value: |it, at| it.voltage(at) * it.current(at) },
    Column {
        name: "terminal",
        unit: "V",
        noise: 0.02,
        value: |it, at| it.voltage(at) - 0.2 * it.current(at),
    },
    Column { name: "shaft", unit: "rad/s", noise: 0.3, value: Machine::shaft },
    Column { name: "gear", unit: "", noise: 0.0, value: Machine::gear },
    Column { name: "wheel", unit: "rad/s", noise: 0.3, value: |it, at| it.shaft(at) / (5.0 - it.gear(at)) },
    Column { name: "inflow", unit: "l/min", noise: 0.1, value: Machine::inflow },
    Column { name: "outflow", unit: "l/min", noise: 0.1, value: Machine::outflow },
    Column { name: "net_flow", unit: "l/min", noise: 0.1, value: |it, at| it.inflow(at) - it.outflow(at) },
    Column {
        name: "valve",
        unit: "%",
        noise: 0.3,
        value: |it, at| (2.0 * it.inflow(at) - 10.0).clamp(35.0, 65.0),
    },
    Column { name: "temperature_1", unit: "degC", noise: 0.05, value: Machine::temperature },
    Column { name: "temperature_2", unit: "degC", noise: 0.08, value: |it, at| it.temperature(at) + 0.4 },
    Column { name: "pressure", unit: "bar", noise: 0.01, value: |it, at| 4.0 + 0.6 * it.wave(8, at) },
    Column { name: "force", unit: "N", noise: 2.0, value: |it, at| 300.0 + 60.0 * it.wave(9, at) },
    Column { name: "level", unit: "m", noise: 0.005, value: |it, at| 2.0 + 0.3 * it.wave(10, at) },
];

/// Writes the recording as CSV.
pub(super) fn write(output: impl Write, size: Size) -> io::Result<()> {
    let mut output = BufWriter::with_capacity(1 << 20, output);
    let count = size.signals.div_ceil(COLUMNS.len());
    let mut chance = Chance::new(22);
    let machines: Vec<Machine> =
        (0..count).map(|_| Machine([(); WAVES].map(|()| Wave::new(&mut chance)))).collect();
    let columns = || machines.iter().enumerate().flat_map(|it| COLUMNS.iter().map(move |of| (it, of)));
    write!(output, "t [s]")?;
    for ((number, _), column) in columns().take(size.signals) {
        let unit = if column.unit.is_empty() { String::new() } else { format!(" [{}]", column.unit) };
        write!(output, ",m{}_{}{unit}", number + 1, column.name)?;
    }
    writeln!(output)?;
    for row in 0..size.rows {
        let time_s = f64::from(row) / f64::from(size.rate);
        write!(output, "{time_s:.3}")?;
        for ((_, machine), column) in columns().take(size.signals) {
            let value = (column.value)(machine, time_s) + column.noise * chance.normal();
            write!(output, ",{value:.4}")?;
        }
        writeln!(output)?;
    }
    output.flush()
}
