//! What the fuzz targets share: readers take paths, so an input becomes a file.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// A folder of this process alone; `scripts/fuzz.sh` has it lie in memory.
static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = std::env::temp_dir().join(std::process::id().to_string());
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    folder
});

/// Hands `read` the path of a file of this name that holds `bytes`.
pub fn as_file<T>(name: &str, bytes: &[u8], read: impl FnOnce(&Path) -> T) -> T {
    let path = FOLDER.join(name);
    std::fs::write(&path, bytes).expect("room for a file");
    read(&path)
}

/// Panics that the product catches are no finding; libFuzzer's own hook would end the process at them.
/// What escapes ends it still.
pub fn allow_caught_panics() {
    static ONCE: std::sync::Once = std::sync::Once::new();
    ONCE.call_once(|| std::panic::set_hook(Box::new(|_| {})));
}

/// Reads a mesh and holds it to what [`alhazen::geometry::TriangleMesh`] promises.
pub fn check_mesh(path: &Path) {
    let Ok(file) = alhazen::io::read_mesh(path) else { return };
    let mesh = file.mesh;
    let n = mesh.positions.len();
    assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < n));
    assert!(mesh.positions.as_flat().iter().all(|x| x.is_finite()));
    assert!(mesh.origin.is_finite());
    assert!(mesh.normals.is_none_or(|normals| normals.len() == n));
    assert!(mesh.uvs.is_none_or(|uvs| uvs.len() == n));
}

/// Loads a scene that names the file `name` in its folder.
pub fn load_beside(scene: &str, name: &str, bytes: &[u8]) {
    as_file(name, bytes, |_| ());
    as_file("scene.toml", scene.as_bytes(), |path| {
        let _ = alhazen::io::load_scene(path, &alhazen::io::LoadOptions::default());
    });
}
