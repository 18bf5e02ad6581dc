//! No method allocates after construction, nor does the code around it.
#![allow(clippy::unwrap_used, reason = "a test may fail loudly, in its helpers too")]

use shsa_core::time::{Span, Time};
use shsa_estimate::average::{Filling, MovingAverage, Window};
use shsa_estimate::bounded::Bounded;
use shsa_estimate::direct::{Direct, Faulty, Rule};
use shsa_estimate::formulas::{Draft, Formulas, Sensor, Vocabulary};
use shsa_estimate::fusion::{Fusion, Gate, Options};
use shsa_estimate::kalman::{Kalman, Loss};
use shsa_estimate::matrix::Matrix;
use shsa_estimate::method::{Measurement, Method};
use shsa_estimate::particle::{Particle, Particles};
use shsa_estimate::unscented::{Points, Unscented};

fn system() -> Formulas {
    Formulas::new(draft()).unwrap()
}

fn draft() -> Draft {
    let mut words = Vocabulary::default();
    words.add_number("p");
    words.add_number("v");
    let formula = |text: &str| words.formula("a test", text).unwrap();
    let sensor = |text: &str| Sensor {
        name: text.into(),
        formula: formula(text),
        variance: formula("0.5"),
        turn: None,
    };
    Draft {
        transition: vec![formula("p + v*dt"), formula("v*cos(p/100)")],
        controls: 0,
        noise: vec![formula("0.4*dt^3/3"), formula("0.4*dt^2/2"), formula("0.4*dt")],
        sensors: vec![sensor("p"), sensor("sqrt(1 + v^2)")],
    }
}

#[track_caller]
fn check(method: Box<dyn Method>, gate: Option<Gate>) {
    let options = Options { horizon: Span(1_000_000_000), moments: 8, gate, unknown_after: Span::MAX };
    let mut fusion = Fusion::new(method, Time(0), 2, 0, options).unwrap();
    let mut feed = |from: i64| {
        for place in from..from + 50 {
            // Two sensors at different rates, one of them late and sometimes far off.
            let at = Time(place * 100_000_000);
            let value = if place % 17 == 0 { 500.0 } else { 1.0 };
            fusion.measure(at, Measurement { sensor: 0, value, variance: None, bound: 0.5 });
            let late = Time((place - 3) * 100_000_000 + 5);
            fusion.measure(late, Measurement { sensor: 1, value: 1.4, variance: Some(0.3), bound: 0.0 });
            assert!(fusion.estimate(at).is_none_or(|estimate| estimate.mean.iter().all(|it| it.is_finite())));
        }
    };
    feed(4);
    let counted = allocation_counter::measure(|| feed(54));
    assert_eq!(counted.count_total, 0);
}

#[test]
fn nothing_is_allocated_per_step() {
    let (mean, p) = ([1.0, 1.0], Matrix::identity(2, 2));
    for gate in [None, Some(Gate::new(0.999, 3))] {
        for loss in [Loss::Square, Loss::Huber(1.345), Loss::Student(4.0)] {
            check(Box::new(Kalman::new(system(), &mean, &p, loss).unwrap()), gate);
        }
        let unscented = || Box::new(Unscented::new(system(), &mean, &p, Points::default()).unwrap());
        check(unscented(), gate);
        check(Box::new(Bounded::new(unscented(), system())), gate);
        check(Box::new(Particle::new(system(), &mean, &p, Particles::default()).unwrap()), gate);
        let faulty = Faulty { count: 0, deviations: 3.0 };
        let average = MovingAverage::new(&[1.0, 2.0, 1.0], Filling::Partial).unwrap();
        let rules = [
            Rule::Average(average),
            Rule::Median(Window::new(5)),
            Rule::Confidence,
            Rule::Marzullo(faulty),
            Rule::Schmid(faulty),
            Rule::BrooksIyengar(faulty),
        ];
        for rule in rules {
            check(Box::new(Direct::new(rule, &[1.0, 1.0], 0.1, (1.0, 1.0)).unwrap()), gate);
        }
    }
}
