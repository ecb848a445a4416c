//! Door of the program in the browser: one function on numbers.
//!
//! The page writes a request into the memory of the program and reads the answer there.

use crate::pull::Hand;
use crate::request::Program;
use std::cell::RefCell;

/// The one window of the page.
const HAND: Hand = 0;

/// Places of an answer: address and length (bytes) of the text, address and count of the numbers.
type Answer = [usize; 4];

#[derive(Default)]
struct Port {
    program: Program,
    request: Vec<u8>,
    answer: Answer,
}

thread_local! {
    static PORT: RefCell<Port> = RefCell::default();
}

/// With a length, makes room for a request of as many bytes and returns its address. With 0,
/// answers the request in that room and returns the address of the four numbers of the answer.
#[allow(unsafe_code, reason = "the name is not mangled, and no other function has it")]
#[unsafe(no_mangle)]
pub extern "C" fn tumble_playground(length: usize) -> usize {
    PORT.with_borrow_mut(|port| {
        if length > 0 {
            port.request.clear();
            port.request.resize(length, 0);
            return port.request.as_ptr().addr();
        }
        let Port { program, request, answer } = port;
        program.answer(HAND, request);
        *answer = [
            program.text.as_ptr().addr(),
            program.text.len(),
            program.numbers.as_ptr().addr(),
            program.numbers.len(),
        ];
        answer.as_ptr().addr()
    })
}
