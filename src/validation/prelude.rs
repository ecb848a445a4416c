//! What most problems are made of.

pub(super) use super::axis::momentum;
pub(super) use super::inputs::EARTH;
pub(super) use super::quantity::{at_most_zero, exactly};
pub(super) use super::slack::{SlideSlack, SlideStep, Slider};
pub(super) use super::stopping::resting;
pub(super) use super::threshold::Threshold;
pub(super) use super::{
    Convergence, Curve, Findings, Input, Inputs, Laboratory, Posed, Run, Setup,
};
pub(super) use super::{Quantity, Solved, Subject, Taken, Unsuitable};
pub(super) use crate::contact::Partner;
pub(super) use crate::geometry::Piece;
pub(super) use crate::mechanics::{Polyline, RigidBody, State};
pub(super) use nalgebra::{Vector2, Vector3, Vector4};
