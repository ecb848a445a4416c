//! Slopes, ridges and valleys.
