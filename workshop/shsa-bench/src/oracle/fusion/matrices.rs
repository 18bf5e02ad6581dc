//! Linear systems by their matrices: the Kalman filter, and the particle filter compared with the exact answer.

use super::{Wanted, matrix, number};
use crate::oracle::Compared;
use serde::Deserialize;
use shsa_estimate::kalman::{Kalman, Loss};
use shsa_estimate::matrix::Matrix;
use shsa_estimate::method::{Measurement, Method};
use shsa_estimate::particle::{Particle, Particles as Options};
use shsa_estimate::system::Linear as System;

/// The matrices of a system.
#[derive(Clone, Deserialize)]
pub(super) struct Matrices {
    #[serde(rename = "A")]
    pub(super) a: Vec<Vec<f64>>,
    #[serde(rename = "B")]
    pub(super) b: Option<Vec<Vec<f64>>>,
    #[serde(rename = "H")]
    pub(super) h: Vec<Vec<f64>>,
    #[serde(rename = "Q")]
    pub(super) q: Vec<Vec<f64>>,
    #[serde(rename = "R")]
    pub(super) r: Vec<Vec<f64>>,
    pub(super) x0: Vec<f64>,
    #[serde(rename = "P0")]
    pub(super) p0: Vec<Vec<f64>>,
}

impl Matrices {
    fn system(&self) -> anyhow::Result<System> {
        let b = self.b.as_ref().map_or(Matrix::zeros(self.a.len(), 0), |b| matrix(b));
        Ok(System::new(matrix(&self.a), b, &matrix(&self.h), matrix(&self.q), matrix(&self.r))?)
    }

    /// A Kalman filter of this system.
    pub(super) fn kalman(&self) -> anyhow::Result<Kalman<System>> {
        Ok(Kalman::new(self.system()?, &self.x0, &matrix(&self.p0), Loss::Square)?)
    }

    /// A particle filter of this system.
    pub(super) fn particle(&self, options: Options) -> anyhow::Result<Particle<System>> {
        Ok(Particle::new(self.system()?, &self.x0, &matrix(&self.p0), options)?)
    }
}

/// The measurements that are present, in the order of the rows.
pub(super) fn measured(z: &[Option<f64>]) -> Vec<Measurement> {
    let present = z.iter().enumerate().filter_map(|(sensor, value)| Some((sensor, (*value)?)));
    present.map(|(sensor, value)| Measurement { sensor, value, variance: None, bound: 0.0 }).collect()
}

#[derive(Deserialize)]
pub(super) struct Linear {
    label: String,
    #[serde(flatten)]
    matrices: Matrices,
    tolerance_x: f64,
    #[serde(rename = "tolerance_P")]
    tolerance_p: f64,
    log_likelihood: f64,
    steps: Vec<Step>,
}

#[derive(Deserialize)]
struct Step {
    z: Vec<Option<f64>>,
    #[serde(default)]
    u: Vec<f64>,
    x: Vec<f64>,
    #[serde(rename = "P")]
    p: Vec<f64>,
    nis: Option<f64>,
    dof: Option<usize>,
}

/// A Kalman filter, step by step; one more answer is its likelihood.
pub(super) fn compare_linear(case: &Linear, compared: &mut Compared) -> anyhow::Result<()> {
    let mut filter = case.matrices.kalman()?;
    let (tolerance_x, tolerance_p) = (case.tolerance_x, case.tolerance_p);
    let mut log_likelihood = 0.0;
    for (place, step) in case.steps.iter().enumerate() {
        let label = format!("{} step {place}", case.label);
        filter.predict(1.0, &step.u);
        let updated = filter.update(&measured(&step.z), &step.u);
        log_likelihood += updated.log_likelihood;
        let wanted = Wanted { x: &step.x, p: &step.p, tolerance_x, tolerance_p };
        let mut differences = wanted.differences(&label, &filter);
        if let Some(dof) = step.dof.filter(|dof| *dof > 0) {
            differences.extend(number(&label, "nis", Some(updated.normalized_square), step.nis, tolerance_x));
            differences
                .extend((dof != updated.used).then(|| format!("{label}: {} used, not {dof}", updated.used)));
        }
        compared.answer(differences);
    }
    let found = Some(log_likelihood);
    compared.answer(
        number(&case.label, "log-likelihood", found, Some(case.log_likelihood), tolerance_x)
            .into_iter()
            .collect(),
    );
    Ok(())
}

#[derive(Deserialize)]
pub(super) struct Particles {
    label: String,
    #[serde(flatten)]
    matrices: Matrices,
    particles: usize,
    mean_tolerance_sigma: f64,
    run_rms_tolerance_sigma: f64,
    variance_ratio: [f64; 2],
    steps: Vec<Step>,
}

/// Thresholds of resampling: always, below 0.8 and below 0.5 of the number of particles.
const RESAMPLE_BELOW: [f64; 3] = [1.0, 0.8, 0.5];

/// Seeds of each: a right filter passes for every one.
const SEEDS: u64 = 5;

/// Compares the particle filter with the exact answer; one answer a run.
pub(super) fn compare_particles(case: &Particles, compared: &mut Compared) -> anyhow::Result<()> {
    for (resample_below, seed) in
        RESAMPLE_BELOW.into_iter().flat_map(|share| (1..=SEEDS).map(move |it| (share, it)))
    {
        let mut filter = case.matrices.particle(Options { count: case.particles, resample_below, seed })?;
        let label = format!("{} resampled below {resample_below}, seed {seed}", case.label);
        let (mut differences, mut squares, mut count) = (Vec::new(), 0.0, 0_usize);
        for (place, step) in case.steps.iter().enumerate() {
            filter.predict(1.0, &step.u);
            filter.update(&measured(&step.z), &step.u);
            let (n, mut diagonal) = (step.x.len(), 0);
            for (i, x) in step.x.iter().enumerate() {
                let variance = step.p[diagonal];
                diagonal += n - i;
                let off = (filter.mean()[i] - x) / variance.sqrt();
                let ratio = filter.spread()[(i, i)] / variance;
                (squares, count) = (squares + off * off, count + 1);
                if off.abs() > case.mean_tolerance_sigma {
                    differences.push(format!("{label} step {place}: state {i} is {off} sigma off"));
                }
                if !(case.variance_ratio[0]..=case.variance_ratio[1]).contains(&ratio) {
                    differences
                        .push(format!("{label} step {place}: variance {i} is {ratio} of the right one"));
                }
            }
        }
        let rms = (squares / count as f64).sqrt();
        if rms > case.run_rms_tolerance_sigma {
            differences.push(format!("{label}: root mean square {rms} sigma"));
        }
        compared.answer(differences);
    }
    Ok(())
}
