//! The picture files of a command: which, and how they are written.

use std::path::{Path, PathBuf};

use super::args::FormatArgs;
use super::{Failure, print, warn};
use crate::film::Film;
use crate::io::{
    Attribute, ExrOptions, PixelType, WriteError, check_writable, write_exr, write_hdr, write_png,
};

/// A file to write.
#[derive(Debug, Clone)]
pub(super) struct Output {
    pub(super) path: PathBuf,
    format: Format,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Format {
    Exr,
    Hdr,
    Png,
}

impl Output {
    /// A file whose format its name says.
    pub(super) fn new(path: PathBuf) -> Result<Self, Failure> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        let format = match extension.as_str() {
            "exr" => Format::Exr,
            "hdr" => Format::Hdr,
            "png" => Format::Png,
            _ => {
                let message = format!(
                    "{}: unknown kind of picture; accepted: .exr, .hdr, .png",
                    path.display()
                );
                return Err(Failure::BadInput(message));
            }
        };
        Ok(Self { path, format })
    }

    /// Whether it can hold more than colours.
    pub(super) fn is_exr(&self) -> bool {
        self.format == Format::Exr
    }

    fn write(
        &self,
        path: &Path,
        film: &Film,
        attributes: &[Attribute],
        how: &FormatArgs,
        quiet: bool,
    ) -> Result<(), WriteError> {
        match self.format {
            Format::Exr => {
                let options = ExrOptions {
                    pixel_type: how.exr_type,
                    compression: how.exr_compression,
                    layout: how.exr_layout,
                };
                let used = write_exr(path, film, attributes, &options)?;
                if used != how.exr_type && !quiet {
                    warn(&format!(
                        "{}: written as {}, as half ends at 65504",
                        path.display(),
                        PixelType::Float.name()
                    ));
                }
                Ok(())
            }
            Format::Hdr => {
                let clipped = write_hdr(path, film)?;
                if clipped > 0 && !quiet {
                    warn(&format!(
                        "{}: {clipped} pixels have values that HDR does not hold: negative ones are \
                         0 there",
                        path.display()
                    ));
                }
                Ok(())
            }
            Format::Png => write_png(path, film, how.exposure, how.tonemap),
        }
    }
}

/// The options that no flag's own parser can refuse.
pub(super) fn check_format(how: &FormatArgs) -> Result<(), Failure> {
    if how.exposure.is_finite() {
        Ok(())
    } else {
        Err(Failure::BadInput("--exposure must be a finite number".to_owned()))
    }
}

/// Writes all of them. One that cannot be written does not keep the others from it, and no work is lost:
/// where none of the best kind could be, the picture goes to the folder for temporary files.
pub(super) fn write_all(
    outputs: &[Output],
    film: &Film,
    attributes: &[Attribute],
    how: &FormatArgs,
    quiet: bool,
) -> Result<(), Failure> {
    // EXR before HDR before PNG: what is lost in these is lost.
    let Some(best) = outputs.iter().map(|output| output.format).min() else { return Ok(()) };
    let mut failures = Vec::new();
    let mut rescued = outputs.iter().find(|output| output.format == best);
    for output in outputs {
        match output.write(&output.path, film, attributes, how, quiet) {
            Ok(()) => {
                rescued = rescued.filter(|_| output.format != best);
                tell_written(&output.path, quiet);
            }
            Err(error) => failures.push(error.to_string()),
        }
    }
    if failures.is_empty() {
        return Ok(());
    }
    if let Some(output) = rescued {
        let write = |path: &Path| output.write(path, film, attributes, how, quiet);
        failures.extend(rescue(&output.path, write));
    }
    Err(Failure::Failed(failures.join("\n")))
}

/// Writes a file; where it cannot be written, it goes to the folder for temporary files.
pub(super) fn write_or_rescue(
    path: &Path,
    quiet: bool,
    write: impl Fn(&Path) -> Result<(), WriteError>,
) -> Result<(), Failure> {
    match write(path) {
        Ok(()) => {
            tell_written(path, quiet);
            Ok(())
        }
        Err(error) => {
            let failures: Vec<_> =
                [error.to_string()].into_iter().chain(rescue(path, write)).collect();
            Err(Failure::Failed(failures.join("\n")))
        }
    }
}

fn tell_written(path: &Path, quiet: bool) {
    if !quiet {
        print(&format!("{:>10}  {}", "wrote", path.display()));
    }
}

/// Writes to the folder for temporary files what could not be written to `path`, and says so.
fn rescue(path: &Path, write: impl Fn(&Path) -> Result<(), WriteError>) -> Option<String> {
    let path = rescue_path(path)?;
    write(&path).ok()?;
    Some(format!("the picture was written to {} instead", path.display()))
}

/// Where a picture goes that cannot be written where it should.
fn rescue_path(path: &Path) -> Option<PathBuf> {
    let name = path.file_name()?.to_string_lossy().into_owned();
    let path = std::env::temp_dir().join(format!("{}-{name}", std::process::id()));
    (!path.exists()).then_some(path)
}

/// Finds out before any work that every file could be written, and that none is written twice or over
/// one that is read.
pub(super) fn check_targets<'a>(
    read: impl IntoIterator<Item = &'a Path>,
    targets: impl IntoIterator<Item = &'a PathBuf>,
) -> Result<(), Failure> {
    let real = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let mut taken: Vec<PathBuf> = read.into_iter().map(real).collect();
    for path in targets {
        check_writable(path).map_err(|e| Failure::BadInput(e.to_string()))?;
        // A file that is not there yet is told by its folder.
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let place = path
            .canonicalize()
            .unwrap_or_else(|_| real(folder).join(path.file_name().unwrap_or_default()));
        if taken.contains(&place) {
            let message = format!("{}: would be written twice, or over an input", path.display());
            return Err(Failure::BadInput(message));
        }
        taken.push(place);
    }
    Ok(())
}
