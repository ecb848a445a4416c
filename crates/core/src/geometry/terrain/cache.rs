//! Pieces that are made at their first use.

use crate::geometry::Piece;
use std::fmt;
use std::sync::OnceLock;

/// Number of pieces in a block.
const BLOCK: usize = 64;

type Block = Box<[OnceLock<Option<Box<Piece>>>]>;

/// Pieces of the triangles of a terrain, in blocks that are made when they are needed.
pub(super) struct Cache {
    blocks: Vec<OnceLock<Block>>,
    count: usize,
}

impl Cache {
    pub fn new(count: usize) -> Self {
        let blocks = (0..count.div_ceil(BLOCK)).map(|_| OnceLock::new()).collect();
        Self { blocks, count }
    }

    /// Number of pieces.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Piece `index`, made by `make` at its first use.
    pub fn get(&self, index: usize, make: impl FnOnce() -> Option<Piece>) -> Option<&Piece> {
        if index >= self.count {
            return None;
        }
        let block = self.blocks[index / BLOCK]
            .get_or_init(|| (0..BLOCK).map(|_| OnceLock::new()).collect());
        block[index % BLOCK].get_or_init(|| make().map(Box::new)).as_deref()
    }
}

/// Without the pieces. Which of them exist depends on the past, and the text of equal worlds is
/// equal.
impl fmt::Debug for Cache {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("Cache").field("count", &self.count).finish_non_exhaustive()
    }
}
