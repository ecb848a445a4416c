//! Turning about a principal axis, as the step does it.

/// The momentum of the spin ω (rad/s) about a principal axis in steps of `h` (s), over the moment I
/// and with its slope by ω: P^±(ω) of eq. 34 there is
///
/// ```text
/// I ω (1 + θ²),   θ = ½ h ω
/// ```
pub(super) fn momentum(h: f64, spin: f64) -> (f64, f64) {
    let square = (0.5 * h * spin).powi(2);
    (spin * (1.0 + square), 1.0 + 3.0 * square)
}
