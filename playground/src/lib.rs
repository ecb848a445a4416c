//! Playground: scenes that one can touch, in a page of the browser.
//!
//! The page runs the native solver as WebAssembly. The text of a scene gives the same bits there
//! and on the command line, and every change in the page is a change of the text:
//!
//! ```text
//! text ─► Session ─► frames ─► page
//!            ▲           │
//!            └── text ◄──┘  a slider, a new body, a grabbed body
//! ```
//!
//! - [`session`] steps a scene, forwards and back.
//! - [`pull`] is the spring between a body and the pointer. Its forces are loads of the scene.
//! - [`change`] makes the text of a changed scene. In a live run it ends a part of the record.
//! - [`server`] gives the page a native program instead, on this machine.
//! - [`request`] is the language between the page and the program, and [`port`] its door.
//!
//! # The door
//!
//! The page calls one function with two integers and reads the memory of the program. Such a
//! function needs no generator of bindings, whose version would have to match. Its name is the only
//! thing that the compiler cannot check, hence one attribute with the word `unsafe`.

#![deny(unsafe_code)]

pub mod change;
pub mod export;
pub mod frame;
mod history;
mod parts;
pub mod port;
pub mod pull;
pub mod request;
pub mod scenes;
pub mod session;

#[cfg(not(target_arch = "wasm32"))]
mod packed;
#[cfg(not(target_arch = "wasm32"))]
pub mod page;
#[cfg(not(target_arch = "wasm32"))]
pub mod server;
