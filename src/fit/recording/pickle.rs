//! The description of a tensor in the pickle that `torch.save` writes, and nothing else of pickles:
//! a stack of plain values. Nothing is called or imported; what would be is looked at.

/// A value of a pickle.
#[derive(Debug, Clone, PartialEq)]
enum Value {
    Mark,
    Number(i64),
    Text(String),
    /// A name of a module, `torch DoubleStorage`.
    Global(String),
    Tuple(Vec<Value>),
    /// What a function would have been given, after its name.
    Call(Box<Value>, Box<Value>),
    /// What lies outside the pickle.
    Persistent(Box<Value>),
    Other,
}

/// What a number of a storage is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Number {
    F32,
    F64,
}

/// A tensor in two dimensions: element (i, j) is number `offset + i strides[0] + j strides[1]` of
/// the storage.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tensor {
    pub number: Number,
    /// The storage's name: the file `data/key`.
    pub key: String,
    pub offset: usize,
    pub shape: [usize; 2],
    pub strides: [usize; 2],
}

/// More bytes than this describe more than one tensor.
const MOST_BYTES: usize = 1 << 14;

/// The tensor that a pickle describes.
pub fn tensor(bytes: &[u8]) -> Result<Tensor, String> {
    if bytes.len() > MOST_BYTES {
        return Err(format!("its pickle is longer than {MOST_BYTES} bytes"));
    }
    describe(&read(bytes)?).ok_or_else(|| {
        "its pickle is not of one tensor of T × 13 floats or doubles as `torch.save` writes it"
            .to_owned()
    })
}

fn describe(value: &Value) -> Option<Tensor> {
    let Value::Call(function, arguments) = value else { return None };
    let Value::Global(name) = &**function else { return None };
    let Value::Tuple(arguments) = &**arguments else { return None };
    let [Value::Persistent(storage), Value::Number(offset), shape, strides, ..] = &arguments[..]
    else {
        return None;
    };
    let Value::Tuple(storage) = &**storage else { return None };
    let [Value::Text(kind), Value::Global(numbers), Value::Text(key), ..] = &storage[..] else {
        return None;
    };
    let number = match numbers.as_str() {
        "torch FloatStorage" => Number::F32,
        "torch DoubleStorage" => Number::F64,
        _ => return None,
    };
    if name != "torch._utils _rebuild_tensor_v2" || kind != "storage" {
        return None;
    }
    let offset = usize::try_from(*offset).ok()?;
    Some(Tensor { number, key: key.clone(), offset, shape: two(shape)?, strides: two(strides)? })
}

fn two(value: &Value) -> Option<[usize; 2]> {
    let Value::Tuple(items) = value else { return None };
    let [Value::Number(a), Value::Number(b)] = items[..] else { return None };
    Some([usize::try_from(a).ok()?, usize::try_from(b).ok()?])
}

/// The pickle's bytes, read from the front.
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or("its pickle ends too early")?;
        self.0 = rest;
        Ok(taken)
    }

    fn unsigned(&mut self, bytes: usize) -> Result<usize, String> {
        let mut number = 0;
        for (k, byte) in self.take(bytes)?.iter().enumerate() {
            number |= usize::from(*byte) << (8 * k);
        }
        Ok(number)
    }

    fn line(&mut self) -> Result<&'a [u8], String> {
        let end = self.0.iter().position(|byte| *byte == b'\n');
        let line = self.take(end.ok_or("its pickle ends too early")? + 1)?;
        Ok(&line[..line.len() - 1])
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Runs the pickle: the value that it stops with.
fn read(bytes: &[u8]) -> Result<Value, String> {
    let mut bytes = Bytes(bytes);
    let (mut stack, mut memo) = (Vec::new(), std::collections::BTreeMap::new());
    let empty = || "its pickle takes more than it has".to_owned();
    loop {
        let code = bytes.take(1)?[0];
        let value = match code {
            // PROTO, FRAME.
            0x80 => {
                bytes.take(1)?;
                continue;
            }
            0x95 => {
                bytes.take(8)?;
                continue;
            }
            b'(' => Value::Mark,
            b'c' => {
                let (module, name) = (bytes.line()?, bytes.line()?);
                Value::Global(format!("{} {}", text(module), text(name)))
            }
            // BINUNICODE, SHORT_BINUNICODE.
            b'X' | 0x8c => {
                let count = bytes.unsigned(if code == b'X' { 4 } else { 1 })?;
                Value::Text(text(bytes.take(count)?))
            }
            // STACK_GLOBAL.
            0x93 => match (stack.pop(), stack.pop()) {
                (Some(Value::Text(name)), Some(Value::Text(module))) => {
                    Value::Global(format!("{module} {name}"))
                }
                _ => return Err(empty()),
            },
            b'K' => Value::Number(bytes.unsigned(1)? as i64),
            b'M' => Value::Number(bytes.unsigned(2)? as i64),
            b'J' => Value::Number(i64::from(bytes.unsigned(4)? as u32 as i32)),
            // BINPUT, LONG_BINPUT, MEMOIZE.
            b'q' | b'r' | 0x94 => {
                let place = match code {
                    b'q' => bytes.unsigned(1)?,
                    b'r' => bytes.unsigned(4)?,
                    _ => memo.len(),
                };
                let value = match stack.last().ok_or_else(empty)? {
                    plain @ (Value::Number(_) | Value::Text(_) | Value::Global(_)) => plain.clone(),
                    // What is made of others is not needed twice, and could double each time.
                    _ => Value::Other,
                };
                memo.insert(place, value);
                continue;
            }
            // BINGET, LONG_BINGET.
            b'h' | b'j' => {
                let place = bytes.unsigned(if code == b'h' { 1 } else { 4 })?;
                memo.get(&place).cloned().ok_or_else(empty)?
            }
            b')' => Value::Tuple(Vec::new()),
            b't' => {
                let mark = stack.iter().rposition(|v| *v == Value::Mark).ok_or_else(empty)?;
                let items = stack.split_off(mark + 1);
                stack.pop();
                Value::Tuple(items)
            }
            0x85..=0x87 => {
                let count = usize::from(code - 0x84);
                let rest = stack.len().checked_sub(count).ok_or_else(empty)?;
                Value::Tuple(stack.split_off(rest))
            }
            b'Q' => Value::Persistent(Box::new(stack.pop().ok_or_else(empty)?)),
            b'R' => {
                let arguments = stack.pop().ok_or_else(empty)?;
                Value::Call(Box::new(stack.pop().ok_or_else(empty)?), Box::new(arguments))
            }
            // NEWTRUE, NEWFALSE, NONE, EMPTY_DICT.
            0x88 | 0x89 | b'N' | b'}' => Value::Other,
            b'.' => return stack.pop().ok_or_else(empty),
            code => {
                return Err(format!("its pickle has the code {code:#04x}, which no tensor needs"));
            }
        };
        stack.push(value);
    }
}
