//! The random faults of a sequence, by seed.

use crate::world::{Fault, Kind, Setting, Target};

/// For this long around a wrong value of one wheel, the two others must be sound and received: a probation plus a second. Two
/// sensors that disagree do not tell which one is wrong.
const WITNESSES: f64 = 6.0;
/// The time between two faults of the same target.
const BREATH: f64 = 0.5;

/// Whether a fault may follow the earlier ones.
fn may_follow(faults: &[Fault], fault: &Fault) -> bool {
    faults.iter().all(|before| {
        let of_wheels = [before, fault].iter().all(|it| matches!(it.target, Target::Wheel(_)));
        let lies = before.kind.is_a_lie() || fault.kind.is_a_lie();
        match (before.target == fault.target, of_wheels && lies) {
            (_, true) => received(faults, before.until, fault.from) >= WITNESSES,
            (true, false) => before.until + BREATH < fault.from,
            (false, false) => true,
        }
    })
}

/// How long the run received its sensors between two times; negative if the second is before the first.
fn received(faults: &[Fault], from: f64, until: f64) -> f64 {
    let deaf = faults.iter().filter(|fault| matches!(fault.target, Target::Broker | Target::Run));
    // The connection is restored within a second.
    let deaf = deaf.map(|fault| (fault.until.min(until) + 1.0 - fault.from.max(from)).max(0.0));
    until - from - deaf.sum::<f64>()
}

/// SplitMix64 (Steele, Lea and Flood 2014, doi:10.1145/2660193.2660195).
pub(super) struct Dice(pub(super) u64);

impl Dice {
    fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (bits ^ (bits >> 31)) % end
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.below(1 << 20) as f64 / (1 << 20) as f64
    }

    fn sign(&mut self) -> f64 {
        if self.below(2) == 0 { 1.0 } else { -1.0 }
    }
}

impl Setting {
    pub(super) fn drawn(dice: &mut Dice) -> Setting {
        let mut toss = || dice.below(2) == 0;
        Setting { has_small_disk: toss(), is_kept: toss(), stamped: [toss(), toss(), toss()] }
    }
}

/// The faults that begin within a time, in order. Only one of the three sensors, chosen at random, may be wrong; all may be
/// absent or repeat messages.
pub(super) fn faults(dice: &mut Dice, span: f64) -> Vec<Fault> {
    let bad = Target::Wheel(dice.below(3) as usize);
    let (mut faults, mut at): (Vec<Fault>, f64) = (Vec::new(), 0.0);
    while at < span {
        let fault = fault(dice, bad, at);
        if may_follow(&faults, &fault) {
            faults.push(fault);
            at += dice.between(0.3, 5.0);
        } else {
            at += 0.2;
        }
    }
    faults
}

fn fault(dice: &mut Dice, bad: Target, from: f64) -> Fault {
    let wheel = Target::Wheel(dice.below(3) as usize);
    let sign = dice.sign();
    let (target, kind) = match dice.below(16) {
        0 | 1 => (wheel, Kind::Killed),
        2 => (wheel, Kind::Suspended),
        3 | 4 => (bad, Kind::Ordered("bias", sign * (dice.between(3.0, 9.0)).round())),
        5 => (bad, Kind::Ordered("drift", sign * dice.between(1.0, 3.0))),
        6 => (bad, Kind::Ordered("freeze", 0.0)),
        7 => (bad, Kind::Ordered("clock", sign * 3_600.0)),
        8 => (wheel, Kind::Ordered("twice", 3.0)),
        9 => (bad, Kind::Ordered("garbage", 2.0)),
        10 | 11 => (wheel, Kind::Ordered("hold", 0.0)),
        12 => (Target::Broker, Kind::Killed),
        13 | 14 => (Target::Run, Kind::Suspended),
        _ => (Target::Disk, Kind::Full),
    };
    Fault { target, kind, from, until: from + dice.between(1.5, 6.0) }
}
