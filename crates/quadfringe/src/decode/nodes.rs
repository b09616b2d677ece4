//! The orders of a scene: nodes on every pixel, or on every second one, and what G and IR tell them.

use crate::angle::{atan2, round, sin_cos, wrap_positive};
use crate::demod::joint::Fringes;
use crate::demod::scene::{RowMaps, Scene};
use crate::unwrap::{Evidence, Support, SupportMaps};
use ndarray::Array3;
use rayon::prelude::*;
use std::f32::consts::TAU;

/// Fringe period in pixels from which on every second pixel has a node.
const COARSE_FROM_PX: f64 = 14.0;

/// Evidence and orders of one shot.
pub(super) struct Nodes {
    support: Support,
    stride: usize,
    columns: usize,
    evidence: Vec<Evidence>,
    sums: Array3<u16>,
    orders: SupportMaps,
}

impl Nodes {
    pub fn new(support: Support) -> Self {
        Self {
            support,
            stride: 1,
            columns: 0,
            evidence: Vec::new(),
            sums: Array3::zeros((0, 0, 0)),
            orders: SupportMaps::default(),
        }
    }

    /// Choose the orders of a wrapped phase by the beats of G and IR, from windows, and make it absolute.
    pub fn by_beats(
        &mut self,
        scene: &Scene<'_>,
        beats: [&Vec<f32>; 4],
        modulation: &[f32],
        phase: &mut [f32],
    ) {
        let (width, stride) = (scene.width, if scene.period_px < COARSE_FROM_PX { 1 } else { 2 });
        (self.stride, self.columns) = (stride, width.div_ceil(stride));
        let nodes = scene.height().div_ceil(stride) * self.columns;
        self.evidence.resize(nodes, Evidence::default());
        self.evidence.par_chunks_mut(self.columns).enumerate().for_each_init(
            RowMaps::default,
            |row_maps, (row, nodes)| {
                let y = row * stride;
                let [g_re, g_im, ir_re, ir_im] = row_maps.sample(scene, y, beats);
                for (node, x) in nodes.iter_mut().zip((0..width).step_by(stride)) {
                    *node = Evidence {
                        phase: Evidence::turns(wrap_positive(phase[y * width + x])),
                        beats: [
                            Evidence::turns(-atan2(g_im[x], g_re[x])),
                            Evidence::turns(-atan2(ir_im[x], ir_re[x])),
                        ],
                        cosines: None,
                        lit: modulation[y * width + x] > 0.0,
                    };
                }
            },
        );
        self.choose(width, phase);
    }

    /// Choose again, now that backgrounds and modulations are known: every node also says what it sees itself.
    pub fn by_cosines(&mut self, scene: &Scene<'_>, fringes: &[Fringes; 4], phase: &mut [f32]) {
        let (width, stride) = (scene.width, self.stride);
        let [r, g, b, ir] = fringes;
        self.evidence.par_chunks_mut(self.columns).enumerate().for_each_init(
            RowMaps::default,
            |row_maps, (row, nodes)| {
                let y = row * stride;
                let slow = [&r.a, &r.b, &b.a, &b.b, &g.a, &g.b, &ir.a, &ir.b];
                let [a_r, b_r, a_b, b_b, a_g, b_g, a_i, b_i] = row_maps.sample(scene, y, slow);
                let [red, green, blue, infrared] = scene.rows(y);
                for (node, x) in nodes.iter_mut().zip((0..width).step_by(stride)) {
                    let (s, c) = sin_cos(phase[y * width + x]);
                    let (model_r, model_b) = (a_r[x] + b_r[x] * c, a_b[x] - b_b[x] * s);
                    let norm = (model_r * model_r + model_b * model_b).max(1e-6);
                    let albedo = (red[x] * model_r + blue[x] * model_b) / norm;
                    let cosine = |light: f32, a: f32, b: f32| {
                        let seen = (light - albedo * a) / (albedo * b).max(1e-6);
                        (seen.clamp(-2.0, 2.0) * 128.0) as i16
                    };
                    node.cosines =
                        Some([cosine(green[x], a_g[x], b_g[x]), cosine(infrared[x], a_i[x], b_i[x])]);
                }
            },
        );
        self.choose(width, phase);
    }

    /// Orders of all nodes, then wrapped to absolute: every pixel takes the order of its node, one more or less where
    /// the wrapped phase turns over in between.
    fn choose(&mut self, width: usize, phase: &mut [f32]) {
        self.support.choose(&self.evidence, self.columns, &mut self.sums, &mut self.orders);
        phase.par_chunks_mut(width).enumerate().for_each(|(y, phase)| {
            for (x, value) in phase.iter_mut().enumerate() {
                let node = self.index(y, x);
                let own = wrap_positive(*value);
                let other = f32::from(self.evidence[node].phase) * (TAU / 65536.0);
                let turned = round((other - own) / TAU);
                *value = own + TAU * (f32::from(self.orders.order[node]) + turned);
            }
        });
    }

    fn index(&self, y: usize, x: usize) -> usize {
        y / self.stride * self.columns + x / self.stride
    }

    /// Lead of the order chosen at a pixel, in [0, 1]; `None` in the dark.
    pub fn margin(&self, y: usize, x: usize) -> Option<f32> {
        let node = self.index(y, x);
        self.evidence[node].lit.then(|| self.orders.margin[node].min(1.0))
    }

    /// Share of the surroundings (a fringe, sigma) whose own light speaks for the order chosen there, on the cells.
    pub fn backing(&self, scene: &Scene<'_>) -> Vec<f32> {
        let grid = scene.grid;
        let mut sums = [vec![1e-6f32; grid.cells()], vec![1e-6f32; grid.cells()]];
        for (i, (node, misfit)) in self.evidence.iter().zip(&self.orders.misfit).enumerate() {
            if node.lit {
                let (y, x) = (i / self.columns * self.stride, i % self.columns * self.stride);
                let cell = y / grid.step * grid.columns + x / grid.step;
                sums[0][cell] += 1.0;
                sums[1][cell] += 1.0 - misfit;
            }
        }
        grid.smooth_all(&mut sums, scene.cells(1.0));
        sums[1].iter().zip(&sums[0]).map(|(agree, all)| (agree / all).clamp(0.0, 1.0)).collect()
    }
}
