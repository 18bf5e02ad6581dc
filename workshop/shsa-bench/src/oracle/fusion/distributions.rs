//! The package's tests of distributions: transformed by functions, their densities, and estimated from samples.

use super::package::{each, points, typed};
use super::{matrix, number};
use crate::oracle::Compared;
use anyhow::{Context, bail};
use serde_json::Value;
use shsa_estimate::matrix::Matrix;
use shsa_estimate::normal::Normal;
use shsa_estimate::random::Random;
use shsa_estimate::unscented::transform;

/// The mean and covariance of a transformed distribution by sigma points.
pub(super) fn transformed(label: &str, case: &Value) -> anyhow::Result<Vec<String>> {
    let text = case["function"].as_str().context("no function")?;
    let degrees = case.get("x_degrees").map(typed::<Vec<f64>>).transpose()?;
    let is_of_angles = degrees.is_some();
    let x: Vec<f64> = match degrees {
        Some(degrees) => degrees.iter().map(|it| it.to_radians()).collect(),
        None => typed(&case["x"])?,
    };
    let n = x.len();
    let diagonal = case.get("Px_diagonal").map_or(Ok(vec![1.0; n]), typed)?;
    let spread = Matrix::from_fn(n, n, |i, j| if i == j { diagonal[i] } else { 0.0 });
    let (outputs, factor) = match text {
        "y = x" => (n, 1.0),
        "y = 2*x" => (n, 2.0),
        "y = (x0, x1)" => (2, 1.0),
        _ if is_of_angles => (n, f64::NAN),
        _ => bail!("{label}: unknown function {text}"),
    };
    let function = |x: &[f64], y: &mut [f64]| {
        y.iter_mut().zip(x).for_each(|(y, x)| *y = if is_of_angles { x.sin() } else { factor * x });
    };
    let (y, own, cross) = transform(&x, &spread, points(n), outputs, function)?;
    let mut differences = Vec::new();
    for i in 0..outputs {
        let (wanted, tolerance) =
            if is_of_angles { (x[i].sin(), diagonal[i]) } else { (factor * x[i], 1e-6) };
        if (y[i] - wanted).abs() > tolerance {
            differences.push(format!("{label} {text}: y{i} is {}, not {wanted}", y[i]));
        }
        for j in 0..n.min(if is_of_angles { 0 } else { n }) {
            let kronecker = f64::from(u8::from(i == j));
            if j < outputs && (own[(i, j)] - factor * factor * kronecker).abs() > 1e-6 {
                differences.push(format!("{label} {text}: Py {i} {j} is {}", own[(i, j)]));
            }
            if (cross[(j, i)] - factor * kronecker).abs() > 1e-6 {
                differences.push(format!("{label} {text}: Pxy {j} {i} is {}", cross[(j, i)]));
            }
        }
    }
    if transform(&x, &Matrix::identity(n + 1, n + 1), points(n), outputs, function).is_ok() {
        differences.push(format!("{label}: a covariance of another size is taken"));
    }
    Ok(differences)
}

/// The density of a normal distribution at a point.
pub(super) fn density(label: &str, case: &Value) -> anyhow::Result<Vec<String>> {
    let (x, mean): (Vec<f64>, Vec<f64>) = (typed(&case["x"])?, typed(&case["mean"])?);
    let normal = Normal::new(&mean, &matrix(&typed::<Vec<Vec<f64>>>(&case["covariance"])?))?;
    let found = Some(normal.density(&x));
    Ok(number(label, "the density", found, case["density"].as_f64(), 1e-12).into_iter().collect())
}

/// Means and covariances of samples, and samples that give no distribution.
pub(super) fn sampled(label: &str, test: &Value, compared: &mut Compared) -> anyhow::Result<()> {
    let tolerance = |what: &str| test["tolerance"][what].as_f64().context("no tolerance");
    let (near_mean, near_covariance) = (tolerance("mean")?, tolerance("covariance")?);
    let sample = |case: &Value| -> anyhow::Result<Vec<String>> {
        let mean: Vec<f64> = typed(&case["mean"])?;
        let covariance = matrix(&typed::<Vec<Vec<f64>>>(&case["covariance"])?);
        let (mut normal, mut random) = (Normal::new(&mean, &covariance)?, Random::new(1));
        let (n, count) = (mean.len(), case["samples"].as_u64().context("no number of samples")?);
        let (mut drawn, mut sum, mut square) = (vec![0.0; n], vec![0.0; n], Matrix::zeros(n, n));
        for _ in 0..count {
            normal.sample(&mut random, &mut drawn);
            for i in 0..n {
                sum[i] += drawn[i] - mean[i];
                (0..n).for_each(|j| square[(i, j)] += (drawn[i] - mean[i]) * (drawn[j] - mean[j]));
            }
        }
        let off = |found: f64, wanted: f64| (found / count as f64 - wanted).abs();
        let is_right = sum.iter().all(|it| off(*it, 0.0) <= near_mean)
            && square
                .iter()
                .zip(covariance.iter())
                .all(|(found, wanted)| off(*found, *wanted) <= near_covariance);
        Ok((!is_right)
            .then(|| format!("{label}: means off by {sum:?}, squares {square}"))
            .into_iter()
            .collect())
    };
    each(test, sample, compared)?;
    let refused = matrix(&typed::<Vec<Vec<f64>>>(&test["error"]["covariance"])?);
    let is_taken = Normal::new(&vec![0.0; refused.nrows()], &refused).is_ok();
    compared.answer(is_taken.then(|| format!("{label}: {refused} is taken")).into_iter().collect());
    let (mut random, uniform) = (Random::new(1), &test["uniform"]);
    let count = uniform["samples"].as_u64().context("no number of samples")?;
    let mean = (0..count).map(|_| random.share()).sum::<f64>() / count as f64;
    let tolerance = uniform["tolerance_of_mean"].as_f64().unwrap_or(0.0);
    let is_off = (mean - 0.5).abs() > tolerance;
    compared
        .answer(is_off.then(|| format!("{label}: the mean of even numbers is {mean}")).into_iter().collect());
    Ok(())
}
