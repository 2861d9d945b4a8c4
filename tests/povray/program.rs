//! The program `povray`.

use std::path::Path;
use std::process::Command;
use std::sync::LazyLock;

use alhazen::color::Rgb;

/// Whether there is a POV-Ray. Where it is missing, one line says that the tests did not run.
pub fn povray() -> bool {
    static FOUND: LazyLock<bool> = LazyLock::new(|| {
        let found = Command::new("povray").arg("--version").output().is_ok();
        if !found {
            eprintln!("not run: no povray; `scripts/setup.sh test` installs it");
        }
        found
    });
    *FOUND
}

/// The pictures that POV-Ray makes of a scene, at most 9, of which `frame_number` is the number; one run
/// is quicker than several. Without antialiasing: a ray through the middle of each pixel. Each value is
/// in [0, 1] with 16 bits, in linear light.
pub fn pictures(scene: &str, [w, h]: [u32; 2], frames: u32) -> Vec<Vec<Rgb>> {
    assert!((1..10).contains(&frames));
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.pov"), scene).unwrap();
    let size = [format!("+W{w}"), format!("+H{h}"), format!("+KFF{frames}")];
    let output = Command::new("povray")
        .args(["+Iscene.pov", "+Oscene.ppm", "+FP16", "File_Gamma=1.0", "-A", "-D"])
        .args(size)
        .current_dir(folder.path())
        .output()
        .expect("povray starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}\n{scene}");
    let picture = |frame: u32| folder.path().join(format!("scene{frame}.ppm"));
    (1..=frames).map(|frame| read_ppm(&picture(frame), [w, h])).collect()
}

/// The values of a binary PPM file of this size and 16 bits.
fn read_ppm(path: &Path, [w, h]: [u32; 2]) -> Vec<Rgb> {
    let bytes = std::fs::read(path).unwrap();
    // The header is text of any length; the pixels are what is at the end.
    let size = 6 * w as usize * h as usize;
    assert!(bytes.starts_with(b"P6") && bytes.len() > size, "{}", path.display());
    let (header, pixels) = bytes.split_at(bytes.len() - size);
    let header = String::from_utf8_lossy(header);
    assert!(header.trim_end().ends_with(&format!("{w} {h}\n65535")), "{header}");
    let value = |b: &[u8]| f32::from(u16::from_be_bytes([b[0], b[1]])) / 65535.0;
    pixels.chunks_exact(6).map(|p| Rgb::new(value(p), value(&p[2..]), value(&p[4..]))).collect()
}
