//! Reading expressions: sums of products of powers, from the left; powers from the right.

use super::tape::{Builder, Tape, Term, Unary};

/// Why a text is no expression.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("at byte {at}: {message}")]
pub struct ExpressionError {
    /// Where, in bytes from the start of the text; its length where something is missing at the end.
    pub at: usize,
    /// What is wrong, and what would be accepted.
    pub message: String,
}

/// Longest text, in bytes.
const MAX_LENGTH: usize = 16_384;
/// Most parentheses, functions, signs and powers within each other.
const MAX_DEPTH: usize = 100;

/// The functions that are known.
const FUNCTIONS: [(&str, Function); 13] = [
    ("sqrt", Function::Unary(Unary::Sqrt)),
    ("cbrt", Function::Unary(Unary::Cbrt)),
    ("abs", Function::Unary(Unary::Abs)),
    ("exp", Function::Unary(Unary::Exp)),
    ("log", Function::Unary(Unary::Ln)),
    ("ln", Function::Unary(Unary::Ln)),
    ("sin", Function::Unary(Unary::Sin)),
    ("cos", Function::Unary(Unary::Cos)),
    ("tan", Function::Tan),
    ("atan", Function::Unary(Unary::Atan)),
    ("min", Function::Min),
    ("max", Function::Max),
    ("pow", Function::Pow),
];

#[derive(Clone, Copy, PartialEq)]
enum Function {
    Unary(Unary),
    Tan,
    Min,
    Max,
    Pow,
}

/// Reads an expression in x, y and z.
pub(super) fn parse(text: &str) -> Result<Tape, ExpressionError> {
    let mut parser = Parser { text, at: 0, depth: 0, builder: Builder::default() };
    if text.len() > MAX_LENGTH {
        let message = format!("the expression is longer than {MAX_LENGTH} bytes");
        return Err(ExpressionError { at: MAX_LENGTH, message });
    }
    let term = parser.sum()?;
    parser.skip_space();
    match parser.peek() {
        None => {}
        Some(')') => return Err(parser.error("no `(` is open that this would close".to_owned())),
        Some(_) => {
            let message = format!("expected {OPERATORS}, not {}", parser.found());
            return Err(parser.error(message));
        }
    }
    parser.builder.finish(term).ok_or_else(|| ExpressionError {
        at: 0,
        message: "the expression is a constant; it must depend on x, y or z".to_owned(),
    })
}

const OPERATORS: &str = "an operator (+ - * / ^) or the end";
const OPERAND: &str = "a number, x, y, z, pi, a function, `-` or `(`";

struct Parser<'t> {
    text: &'t str,
    at: usize,
    depth: usize,
    builder: Builder,
}

impl Parser<'_> {
    fn sum(&mut self) -> Result<Term, ExpressionError> {
        let mut left = self.product()?;
        while let Some(operator) = self.next_of("+-") {
            let at = self.at - 1;
            let right = self.product()?;
            let sum = if operator == '+' {
                self.builder.add(left, right)
            } else {
                self.builder.sub(left, right)
            };
            left = checked(sum, at)?;
        }
        Ok(left)
    }

    fn product(&mut self) -> Result<Term, ExpressionError> {
        let mut left = self.signed()?;
        while let Some(operator) = self.next_of("*/") {
            let at = self.at - 1;
            let right = self.signed()?;
            let product = if operator == '*' {
                self.builder.mul(left, right)
            } else {
                self.builder.div(left, right)
            };
            left = checked(product, at)?;
        }
        Ok(left)
    }

    /// A sign binds less than a power: −x² is −(x²).
    fn signed(&mut self) -> Result<Term, ExpressionError> {
        match self.next_of("+-") {
            Some('-') => {
                let term = self.nested(Self::signed)?;
                Ok(self.builder.unary(Unary::Neg, term))
            }
            Some(_) => self.nested(Self::signed),
            None => self.power(),
        }
    }

    fn power(&mut self) -> Result<Term, ExpressionError> {
        let base = self.operand()?;
        if self.next_of("^").is_none() {
            return Ok(base);
        }
        let at = self.at - 1;
        let exponent = self.nested(Self::signed)?;
        checked(self.builder.raise(base, exponent), at)
    }

    fn operand(&mut self) -> Result<Term, ExpressionError> {
        self.skip_space();
        let start = self.at;
        match self.peek() {
            Some('(') => {
                self.at += 1;
                let term = self.nested(Self::sum)?;
                self.close(start, "")?;
                Ok(term)
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_alphabetic() || c == '_' => self.name(),
            _ => {
                let message = format!("expected {OPERAND}, not {}", self.found());
                Err(self.error(message))
            }
        }
    }

    fn number(&mut self) -> Result<Term, ExpressionError> {
        let start = self.at;
        self.take_while(|c| c.is_ascii_digit() || c == '.');
        // An exponent, if digits follow.
        let rest = &self.text.as_bytes()[self.at..];
        if let Some(b'e' | b'E') = rest.first() {
            let sign = usize::from(matches!(rest.get(1), Some(b'+' | b'-')));
            if rest.get(1 + sign).is_some_and(u8::is_ascii_digit) {
                self.at += 1 + sign;
                self.take_while(|c| c.is_ascii_digit());
            }
        }
        let digits = &self.text[start..self.at];
        match digits.parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(Term::Known(x)),
            _ => {
                let message = format!("`{digits}` is no number of at most 1.8e308");
                Err(ExpressionError { at: start, message })
            }
        }
    }

    fn name(&mut self) -> Result<Term, ExpressionError> {
        let start = self.at;
        self.take_while(|c| c.is_alphanumeric() || c == '_');
        let name = &self.text[start..self.at];
        match name {
            "x" => return Ok(self.builder.coordinate(0)),
            "y" => return Ok(self.builder.coordinate(1)),
            "z" => return Ok(self.builder.coordinate(2)),
            "pi" => return Ok(Term::Known(std::f64::consts::PI)),
            _ => {}
        }
        let Some(&(name, function)) = FUNCTIONS.iter().find(|(known, _)| *known == name) else {
            let functions: Vec<&str> = FUNCTIONS.iter().map(|(name, _)| *name).collect();
            let functions = functions.join(", ");
            let message = format!(
                "unknown name `{name}`; accepted: x, y, z, pi and the functions {functions}"
            );
            return Err(ExpressionError { at: start, message });
        };
        self.skip_space();
        if self.peek() != Some('(') {
            let message = format!("expected `(` after `{name}`, not {}", self.found());
            return Err(self.error(message));
        }
        self.at += 1;
        let (arguments, result) = self.nested(|parser| parser.arguments(function))?;
        self.close(start, name)?;
        let wanted = match function {
            Function::Unary(_) | Function::Tan if arguments != 1 => "one argument",
            Function::Pow if arguments != 2 => "two arguments",
            Function::Min | Function::Max if arguments < 2 => "two arguments or more",
            _ => return checked(result, start),
        };
        let message = format!("`{name}` takes {wanted}, not {arguments}");
        Err(ExpressionError { at: start, message })
    }

    /// The arguments of a function: how many, and its value.
    fn arguments(&mut self, function: Function) -> Result<(usize, Term), ExpressionError> {
        let mut result = self.sum()?;
        let mut count = 1;
        while self.next_of(",").is_some() {
            let next = self.sum()?;
            count += 1;
            result = match function {
                Function::Min => self.builder.min(result, next),
                Function::Max => self.builder.max(result, next),
                Function::Pow => self.builder.raise(result, next),
                Function::Unary(_) | Function::Tan => next,
            };
        }
        match function {
            Function::Unary(f) => result = self.builder.unary(f, result),
            Function::Tan => {
                let sin = self.builder.unary(Unary::Sin, result);
                let cos = self.builder.unary(Unary::Cos, result);
                result = self.builder.div(sin, cos);
            }
            Function::Min | Function::Max | Function::Pow => {}
        }
        Ok((count, result))
    }

    fn close(&mut self, open: usize, name: &str) -> Result<(), ExpressionError> {
        if self.next_of(")").is_some() {
            return Ok(());
        }
        let or_comma = if name.is_empty() { "" } else { ", `,`" };
        let message = format!(
            "expected an operator (+ - * / ^){or_comma} or `)` for the `{name}(` at character {}, not {}",
            self.text[..open].chars().count() + 1,
            self.found()
        );
        Err(self.error(message))
    }

    /// One level deeper, which the stack must hold.
    fn nested<T>(
        &mut self,
        read: impl FnOnce(&mut Self) -> Result<T, ExpressionError>,
    ) -> Result<T, ExpressionError> {
        if self.depth == MAX_DEPTH {
            let message = format!("more than {MAX_DEPTH} parentheses, signs or powers deep");
            return Err(self.error(message));
        }
        self.depth += 1;
        let result = read(self);
        self.depth -= 1;
        result
    }

    fn peek(&self) -> Option<char> {
        self.text[self.at..].chars().next()
    }

    fn skip_space(&mut self) {
        self.take_while(char::is_whitespace);
    }

    fn take_while(&mut self, accept: impl Fn(char) -> bool) {
        let rest = &self.text[self.at..];
        self.at += rest.find(|c| !accept(c)).unwrap_or(rest.len());
    }

    /// The next character, if it is one of `accepted`.
    fn next_of(&mut self, accepted: &str) -> Option<char> {
        self.skip_space();
        let next = self.peek().filter(|&c| accepted.contains(c))?;
        self.at += next.len_utf8();
        Some(next)
    }

    /// What stands here, for messages.
    fn found(&self) -> String {
        self.peek().map_or("the end".to_owned(), |c| format!("`{c}`"))
    }

    fn error(&self, message: String) -> ExpressionError {
        ExpressionError { at: self.at, message }
    }
}

/// Refuses numbers that are none: 1/0, sqrt(−1).
fn checked(term: Term, at: usize) -> Result<Term, ExpressionError> {
    match term {
        Term::Known(x) if !x.is_finite() => Err(ExpressionError {
            at,
            message: format!("this is the number {x}, which is not finite"),
        }),
        _ => Ok(term),
    }
}
