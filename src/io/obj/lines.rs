//! The lines of an OBJ file, and the words of a line.

/// Makes `bytes` text of one byte per letter where it matters: UTF-16 becomes UTF-8, a byte order
/// mark goes, and the carriage returns of old Macintosh files become line feeds.
pub(super) fn normalize(mut bytes: Vec<u8>) -> Vec<u8> {
    let utf16 = |rest: &[u8], unit: fn([u8; 2]) -> u16| {
        let units = rest.as_chunks::<2>().0.iter().map(|&pair| unit(pair));
        char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
    };
    let text: Option<String> = match bytes[..] {
        [0xfe, 0xff, ref rest @ ..] => Some(utf16(rest, u16::from_be_bytes)),
        [0xff, 0xfe, ref rest @ ..] => Some(utf16(rest, u16::from_le_bytes)),
        _ => None,
    };
    if let Some(text) = text {
        bytes = text.into_bytes();
    } else if bytes.starts_with(b"\xef\xbb\xbf") {
        bytes[..3].fill(b' ');
    }
    if !bytes.contains(&b'\n') {
        bytes.iter_mut().filter(|b| **b == b'\r').for_each(|b| *b = b'\n');
    }
    bytes
}

/// Cuts `bytes` at line ends into pieces of about `size` bytes.
pub(super) fn chunks(bytes: &[u8], size: usize) -> Vec<&[u8]> {
    let mut chunks = Vec::with_capacity(bytes.len() / size + 1);
    let mut rest = bytes;
    while !rest.is_empty() {
        let mut end = size.min(rest.len());
        let is_end = |end: usize| rest[end - 1] == b'\n' && !is_continued(&rest[..end - 1]);
        while end < rest.len() && !is_end(end) {
            end += 1;
        }
        let chunk;
        (chunk, rest) = rest.split_at(end);
        chunks.push(chunk);
    }
    chunks
}

/// Whether a line, without its line feed, goes on in the next.
fn is_continued(line: &[u8]) -> bool {
    line.strip_suffix(b"\r").unwrap_or(line).ends_with(b"\\")
}

/// The lines of a text that say something, each with what it was continued by.
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    /// Lines before `rest`.
    passed: usize,
}

/// A line, first word apart.
pub(super) struct Line<'a> {
    /// From 1.
    pub number: usize,
    pub keyword: &'a [u8],
    pub words: Words<'a>,
}

impl<'a> Lines<'a> {
    /// Of `text`, which begins after `passed` lines.
    pub fn new(text: &'a [u8], passed: usize) -> Self {
        Self { rest: text, passed }
    }

    /// Lines up to here.
    pub fn passed(&self) -> usize {
        self.passed
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = Line<'a>;

    fn next(&mut self) -> Option<Line<'a>> {
        loop {
            if self.rest.is_empty() {
                return None;
            }
            let number = self.passed + 1;
            let is_comment = self.rest.iter().find(|b| !is_space(**b)) == Some(&b'#');
            let mut end = 0;
            loop {
                let feed = self.rest[end..].iter().position(|&b| b == b'\n');
                let line = &self.rest[end..end + feed.unwrap_or(self.rest.len() - end)];
                self.passed += 1;
                end += line.len() + usize::from(feed.is_some());
                // A comment that ends in a backslash may well be a path of Windows.
                if end == self.rest.len() || is_comment || !is_continued(line) {
                    break;
                }
            }
            let line;
            (line, self.rest) = self.rest.split_at(end);
            let mut words = Words(line);
            if let Some(keyword) = words.next() {
                return Some(Line { number, keyword, words });
            }
        }
    }
}

/// White space; a backslash too, which in a line of numbers can only continue it.
fn is_space(b: u8) -> bool {
    b.is_ascii_whitespace() || matches!(b, b'\\' | 0x0b)
}

/// Words separated by white space, up to a comment.
#[derive(Clone)]
pub(super) struct Words<'a>(&'a [u8]);

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    #[inline]
    fn next(&mut self) -> Option<&'a [u8]> {
        let start = self.0.iter().position(|&b| !is_space(b))?;
        let rest = &self.0[start..];
        if rest[0] == b'#' {
            self.0 = &[];
            return None;
        }
        let word;
        let len = rest.iter().position(|&b| is_space(b)).unwrap_or(rest.len());
        (word, self.0) = rest.split_at(len);
        Some(word)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &[u8]) -> Vec<(usize, String, Vec<String>)> {
        let string = |word: &[u8]| String::from_utf8_lossy(word).into_owned();
        Lines::new(text, 0)
            .map(|l| (l.number, string(l.keyword), l.words.map(string).collect()))
            .collect()
    }

    #[test]
    fn continued_and_commented_lines() {
        let text = b"# c\\\nv 1 \\\n 2\\\r\n3 # 4\n\n \t\r\nf\t1/2  3 \nx";
        let found = all(text);
        let expected = [(2, "v", &["1", "2", "3"][..]), (7, "f", &["1/2", "3"]), (8, "x", &[])];
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(expected) {
            assert_eq!((found.0, &found.1[..]), (expected.0, expected.1));
            assert_eq!(found.2, expected.2);
        }
    }

    /// However small the pieces, they hold the same lines.
    #[test]
    fn chunks_keep_lines_whole() {
        let text = b"v 1 2 3\nf 1 \\\n2 \\\r\n3\n\n# x \\\nv 4 5 6\r\nf 1 2 3\\";
        let whole = all(text);
        for size in 1..text.len() + 2 {
            let (mut joined, mut passed) = (Vec::new(), 0);
            for chunk in chunks(text, size) {
                let mut lines = Lines::new(chunk, passed);
                for l in lines.by_ref() {
                    joined.push((l.number, l.keyword.to_vec(), l.words.count()));
                }
                passed = lines.passed();
            }
            assert_eq!(joined.len(), whole.len(), "size {size}");
            for (a, b) in joined.iter().zip(&whole) {
                assert_eq!((a.0, &a.1[..], a.2), (b.0, b.1.as_bytes(), b.2.len()));
            }
        }
    }

    #[test]
    fn encodings() {
        let text = "v 1 2 3\nf é\n";
        let be: Vec<u8> = "\u{feff}v 1".encode_utf16().flat_map(u16::to_be_bytes).collect();
        let le: Vec<u8> = "\u{feff}v 1".encode_utf16().flat_map(u16::to_le_bytes).collect();
        assert_eq!(normalize(be), b"v 1");
        assert_eq!(normalize(le), b"v 1");
        assert_eq!(normalize(text.into()), text.as_bytes());
        assert_eq!(normalize(b"\xef\xbb\xbfv 1\n".to_vec()), b"   v 1\n");
        assert_eq!(normalize(b"v 1\rv 2\r".to_vec()), b"v 1\nv 2\n");
        assert_eq!(normalize(b"\xfe\xff\x00".to_vec()), b"");
    }
}
