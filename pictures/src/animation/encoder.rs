//! Pictures in a row as one file, each as what it changes of the one before.

use super::canvas::Canvas;
use super::difference::Changed;
use super::palette::{Colour, Palette};
use super::settings::{AnimationError, Format};
use super::timing::{self, FRAMES_A_SECOND};
use crate::film::Film;
use gif::{AnyExtension, DisposalMethod, Repeat};
use png::{BitDepth, BlendOp, ColorType, Compression};
use std::borrow::Cow;

/// The GIF's comment extension.
const COMMENT: AnyExtension = AnyExtension(0xfe);

/// Writes frames behind each other.
pub struct Encoder<'a> {
    size: usize,
    stream: Stream<'a>,
}

/// An encoder and the picture before.
enum Stream<'a> {
    Gif { encoder: gif::Encoder<&'a mut Vec<u8>>, palette: Palette, before: Vec<u8> },
    Png { writer: png::Writer<&'a mut Vec<u8>>, before: Vec<Colour> },
}

impl<'a> Encoder<'a> {
    /// The beginning of a file of so many `frames`, `size` pixels wide.
    pub fn new(
        bytes: &'a mut Vec<u8>,
        film: &Film,
        format: Format,
        size: u16,
        frames: u32,
    ) -> Result<Self, AnimationError> {
        let stream = match format {
            Format::Gif => {
                let palette = Palette::of(film);
                let mut encoder = gif::Encoder::new(bytes, size, size, &palette.bytes())?;
                encoder.set_repeat(Repeat::Infinite)?;
                let title: Vec<&[u8]> = film.title.as_bytes().chunks(255).collect();
                encoder.write_raw_extension(COMMENT, &title)?;
                Stream::Gif { encoder, palette, before: Vec::new() }
            }
            Format::Png => {
                let mut encoder = png::Encoder::new(bytes, size.into(), size.into());
                encoder.set_color(ColorType::Rgba);
                encoder.set_depth(BitDepth::Eight);
                encoder.set_compression(Compression::Balanced);
                encoder.set_filter(png::Filter::NoFilter);
                // As often as its viewer likes.
                encoder.set_animated(frames, 0)?;
                encoder.set_frame_delay(1, FRAMES_A_SECOND as u16)?;
                encoder.set_blend_op(BlendOp::Over)?;
                encoder.add_itxt_chunk("Title".to_owned(), film.title.clone())?;
                Stream::Png { writer: encoder.write_header()?, before: Vec::new() }
            }
        };
        Ok(Self { size: size.into(), stream })
    }

    /// Adds frame `k`.
    pub fn add(&mut self, k: u64, canvas: &Canvas) -> Result<(), AnimationError> {
        match &mut self.stream {
            Stream::Gif { encoder, palette, before } => {
                let now: Vec<_> = canvas.colours().map(|colour| palette.index(colour)).collect();
                let changed = Changed::between(before, &now, self.size);
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
            }
            Stream::Png { writer, before } => {
                let now: Vec<_> = canvas.colours().collect();
                let changed = Changed::between(before, &now, self.size);
                let (columns, rows) = (&changed.columns, &changed.rows);
                // A frame has to lie in the picture at every moment.
                writer.reset_frame_position()?;
                writer.set_frame_dimension(columns.len() as u32, rows.len() as u32)?;
                writer.set_frame_position(columns.start as u32, rows.start as u32)?;
                let bytes = |pixel: Option<Colour>| {
                    pixel.map_or([0; 4], |[red, green, blue]| [red, green, blue, 255])
                };
                let pixels = changed.pixels(before, &now);
                writer.write_image_data(&pixels.flat_map(bytes).collect::<Vec<_>>())?;
                *before = now;
            }
        }
        Ok(())
    }

    /// The end of the file.
    pub fn finish(self) -> Result<(), AnimationError> {
        match self.stream {
            // The trailer is written when the encoder goes.
            Stream::Gif { encoder, .. } => drop(encoder),
            Stream::Png { writer, .. } => writer.finish()?,
        }
        Ok(())
    }
}
