//! Second sound: heat flux that follows the gradient with a relaxation time.

use stagger_coupling::math;

use crate::common::grid::conduction::Conduction;

/// τ q̇ + q = −K ∇θ over a window, with ∇θ taken as constant (Zohdi 2018, eqs. 5.98–5.111):
///
/// q(t + Δt) = (q(t) + K∇θ) e^{−Δt/τ} − K∇θ
///
/// so that the mean flux of the window is β (−K∇θ) + (1 − β) q(t), β = 1 − (1 − e^{−Δt/τ}) τ/Δt: Fourier's law for τ → 0, and
/// the flux of the start for τ → ∞. Heat that enters or leaves through the faces of the box follows at once.
#[derive(Clone, Copy)]
pub(super) struct Relaxation {
    /// β.
    pub(super) instant: f64,
    /// e^{−Δt/τ}.
    kept: f64,
}

impl Relaxation {
    pub(super) fn new(relaxation_s: f64, dt_s: f64) -> Self {
        if relaxation_s <= 0.0 {
            return Self { instant: 1.0, kept: 0.0 };
        }
        let ratio = dt_s / relaxation_s;
        let left = -math::exp_m1(-ratio);
        // 1 − (1 − e^{−x})/x loses its digits for small x: x/2 − x²/6 + x³/24.
        let instant =
            if ratio < 1e-4 { ratio * (0.5 - ratio * (1.0 / 6.0 - ratio / 24.0)) } else { 1.0 - left / ratio };
        Self { instant, kept: 1.0 - left }
    }

    /// The fluxes through the faces between cells at the window's end, in W, upwards along each axis: from those at its start
    /// and the temperatures that make the gradient.
    pub(super) fn advance(&self, conduction: &Conduction, values_k: &[f64], fluxes_w: &mut [Vec<f64>; 3]) {
        let strides = conduction.strides();
        for (axis, fluxes_w) in fluxes_w.iter_mut().enumerate() {
            let conductances_w_k = conduction.upwards_w_k(axis);
            for (row, flux_w) in fluxes_w.iter_mut().enumerate() {
                let conductance_w_k = conductances_w_k[row];
                if conductance_w_k > 0.0 {
                    let fourier_w = conductance_w_k * (values_k[row] - values_k[row + strides[axis]]);
                    *flux_w = (*flux_w - fourier_w) * self.kept + fourier_w;
                }
            }
        }
    }
}

/// Adds to the heat that flows into each cell a share of given fluxes, in W.
pub(super) fn add_fluxes(strides: [usize; 3], share: f64, fluxes_w: &[Vec<f64>; 3], into_w: &mut [f64]) {
    for (fluxes_w, stride) in fluxes_w.iter().zip(strides) {
        for (row, flux_w) in fluxes_w.iter().enumerate().filter(|(_, flux_w)| **flux_w != 0.0) {
            let flow_w = share * flux_w;
            into_w[row] -= flow_w;
            into_w[row + stride] += flow_w;
        }
    }
}
