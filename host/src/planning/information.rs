//! What a circle would tell of every explanation: products of the causes' signatures over one turn, with the
//! noise of a sample and the scatter between runs in the metric.
use super::grid::Circle;
use crate::causes::{Cause, RunView, Site};
use crate::diagnosis::Diagnosis;
use crate::diagnosis::low_orders::{Basis, COLUMNS, ORDERS};
use crate::diagnosis::spread::Spread;
use crate::diagnosis::survey::Response;
use crate::diagnosis::vector::dot;
use giotto_shared::Frame;
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Samples of a view, and of the turn it stands for.
const VIEW: usize = 720;
const TURN: f64 = 1000.0;

/// One column of the regression.
#[derive(Clone, Debug)]
pub struct Column {
    /// Which cause; nothing: the second cumulant of the simulation itself.
    pub cause: Option<Cause>,
    /// Where.
    pub site: Site,
    /// Parameters of the signature.
    pub shape: Vec<f64>,
    /// Which of its columns.
    pub at: usize,
    /// m of deviation that one unit of the contract's value makes at most; 1 for the simulation's own.
    pub scale: f64,
}

/// The motion of circles under a response.
pub fn views(circles: &[Circle], response: &Response, elapsed: &[f64]) -> Vec<RunView> {
    let largest = circles.iter().map(|c| c.radius_m).fold(0.0, f64::max);
    circles
        .iter()
        .zip(elapsed)
        .map(|(circle, elapsed)| {
            let sign = f64::from(circle.direction.sign());
            let omega = circle.feed_m_s / circle.radius_m;
            let angle = |i: usize| TAU * i as f64 / VIEW as f64;
            let mut view = RunView {
                radius_m: circle.radius_m,
                feed_m_s: circle.feed_m_s,
                omega_rad_s: omega,
                sign,
                frame: Frame::of(circle.plane),
                centre_m: [0.0; 3],
                elapsed: *elapsed,
                campaign_s: 3600.0,
                largest_radius_m: largest,
                psi_rad: Arc::default(),
                direction: Arc::default(),
                strokes: Default::default(),
                time_s: (0..VIEW).map(|i| angle(i) / omega).collect(),
                gain: response.gain(omega),
                arm: None,
                lag_rad: (response.a_s2.max(0.0).sqrt() * omega).atan(),
            };
            view.place((0..VIEW).map(|i| sign * angle(i)).collect());
            view
        })
        .collect()
}

/// Noise and scatter of a diagnosis: that of the size is taken for the even orders as well.
pub fn spread(diagnosis: &Diagnosis) -> Spread {
    let between = diagnosis.spread_um.max(0.1).powi(2) * 1e-12;
    let mut order_m2 = [between; ORDERS + 1];
    order_m2[1] = 0.0;
    let noise_m2 = diagnosis.noise_um.max(0.1).powi(2) * 1e-12 * VIEW as f64 / TURN;
    Spread {
        sample_m2: noise_m2,
        noise_m2,
        order_m2,
    }
}

fn samples(column: &Column, view: &RunView) -> Vec<f64> {
    let mut out = vec![0.0; VIEW];
    match column.cause {
        Some(cause) => {
            cause
                .model()
                .signature(column.site, &column.shape, column.at, view, &mut out)
        }
        None => out.fill(-0.5 * view.radius_m * view.omega_rad_s.powi(2) * view.gain.powi(3)),
    }
    out
}

/// Sets the scale of every column to its largest deviation over the views.
pub fn scale(columns: &mut [Column], views: &[RunView]) {
    for column in columns {
        let largest = views
            .iter()
            .flat_map(|view| samples(column, view))
            .fold(0.0, |largest: f64, y| largest.max(y.abs()));
        column.scale = if largest > 0.0 { largest } else { 1.0 };
    }
}

/// Information of each view: Σ of products of the scaled columns (m⁻²), centre free, scatter discounted.
pub fn products(columns: &[Column], views: &[RunView], spread: &Spread) -> Vec<DMatrix<f64>> {
    let discounts = spread.discounts(VIEW);
    views
        .par_iter()
        .map(|view| {
            let basis = Basis::new(&view.psi_rad);
            let all: Vec<(Vec<f64>, [f64; COLUMNS])> = columns
                .iter()
                .map(|column| {
                    let mut y = samples(column, view);
                    y.iter_mut().for_each(|y| *y /= column.scale);
                    let low = basis.coordinates(&y);
                    (y, low)
                })
                .collect();
            DMatrix::from_fn(columns.len(), columns.len(), |i, j| {
                let (a, b) = (&all[i.min(j)], &all[i.max(j)]);
                let taken: f64 = (0..COLUMNS).map(|k| discounts[k] * a.1[k] * b.1[k]).sum();
                (dot(&a.0, &b.0) - taken) / spread.noise_m2
            })
        })
        .collect()
}
