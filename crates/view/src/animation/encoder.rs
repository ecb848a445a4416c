//! GIF encoder. Each frame stores its difference from the previous one.

use super::canvas::Canvas;
use super::difference::Changed;
use super::palette::Palette;
use super::settings::{AnimationError, AnimationSettings};
use super::timing;
use crate::MARK;
use crate::film::Film;
use gif::{AnyExtension, DisposalMethod, Repeat};
use std::borrow::Cow;

/// Comment extension of GIF.
const COMMENT: AnyExtension = AnyExtension(0xfe);

/// Encoder of successive frames.
pub struct Encoder<'a> {
    size: usize,
    encoder: gif::Encoder<&'a mut Vec<u8>>,
    palette: Palette,
    /// Palette indices of the previous frame; empty before the first.
    before: Vec<u8>,
}

impl<'a> Encoder<'a> {
    /// Starts a file with frames of `size` by `size` pixels.
    pub fn new(
        bytes: &'a mut Vec<u8>,
        film: &Film,
        settings: &AnimationSettings,
    ) -> Result<Self, AnimationError> {
        let size = settings.size;
        let palette = Palette::new(film, settings.theme());
        let mut encoder = gif::Encoder::new(bytes, size, size, &palette.bytes())?;
        encoder.set_repeat(Repeat::Infinite)?;
        encoder.write_raw_extension(COMMENT, &[MARK.as_bytes()])?;
        let title: Vec<&[u8]> = film.title.as_bytes().chunks(255).collect();
        encoder.write_raw_extension(COMMENT, &title)?;
        Ok(Self { size: size.into(), encoder, palette, before: Vec::new() })
    }

    /// Adds frame `k`.
    pub fn add(&mut self, k: u64, canvas: &Canvas) -> Result<(), AnimationError> {
        let Self { size, encoder, palette, before } = self;
        let now: Vec<_> = canvas.colours().map(|colour| palette.index(colour)).collect();
        let changed = Changed::between(before, &now, *size);
        let unchanged = palette.transparent();
        let pixels = changed.pixels(before, &now);
        encoder.write_frame(&gif::Frame {
            delay: timing::delay(k),
            left: changed.columns.start as u16,
            top: changed.rows.start as u16,
            width: changed.columns.len() as u16,
            height: changed.rows.len() as u16,
            dispose: DisposalMethod::Keep,
            transparent: (!before.is_empty()).then_some(unchanged),
            buffer: Cow::Owned(pixels.map(|pixel| pixel.unwrap_or(unchanged)).collect()),
            ..gif::Frame::default()
        })?;
        *before = now;
        Ok(())
    }
}
