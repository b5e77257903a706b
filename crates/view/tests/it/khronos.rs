//! Checks the files with the Khronos validator (npm `gltf-validator`, in the folder HWALL_GLTF_VALIDATOR or in `target/browser`). If it is
//! absent, the test prints `skipped: ...`.

use crate::common::{any_frame, frames, full_frame, scene};
use hwall_testkit::Sampler;
use hwall_view::{ViewFrame, glb};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Prints errors and warnings of files, and fails if there are any.
const VALIDATE: &str = r#"
const [folder, ...files] = process.argv.slice(1);
const { validateBytes } = require(folder);
(async () => {
  for (const file of files) {
    const { issues } = await validateBytes(new Uint8Array(require("fs").readFileSync(file)));
    for (const { severity, code, pointer, message } of issues.messages)
      if (severity < 2) console.log(`${file}: ${code}: ${message} (${pointer})`);
    if (issues.numErrors + issues.numWarnings || issues.truncated) process.exitCode = 1;
  }
})();
"#;

fn validator() -> Option<PathBuf> {
    let named = std::env::var_os("HWALL_GLTF_VALIDATOR").map(PathBuf::from);
    let installed = "../browser/node_modules/gltf-validator";
    let installed = Path::new(env!("CARGO_TARGET_TMPDIR")).join(installed);
    let folders = [named, Some(installed)];
    let is_there = |folder: &PathBuf| folder.join("package.json").exists();
    folders.into_iter().flatten().find(is_there)
}

fn random_frames() -> Vec<ViewFrame> {
    let mut sampler = Sampler::new(5);
    (0..200)
        .map(|k| any_frame(1.7e9 + 0.05 * f64::from(k), &mut sampler))
        .collect()
}

#[test]
fn the_khronos_validator_neither_objects_nor_warns() {
    let files = [
        ("still", glb(&scene(), &[])),
        ("one key", glb(&scene(), &[full_frame(0.0)])),
        ("session", glb(&scene(), &frames(3.0))),
        ("at random", glb(&scene(), &random_frames())),
    ];
    let node = Command::new("node").arg("--version").output();
    let Some(validator) = validator().filter(|_| node.is_ok()) else {
        let _ = writeln!(
            std::io::stderr(),
            "skipped: khronos: no node or no gltf-validator"
        );
        return;
    };
    let path = |name: &str| {
        Path::new(env!("CARGO_TARGET_TMPDIR"))
            .join(name)
            .with_extension("glb")
    };
    for (name, file) in &files {
        std::fs::write(path(name), file).unwrap();
    }
    let paths = files.iter().map(|(name, _)| path(name));
    let output = Command::new("node")
        .args(["-e", VALIDATE])
        .arg(validator)
        .args(paths)
        .output();
    for (name, _) in &files {
        std::fs::remove_file(path(name)).unwrap();
    }
    let output = output.unwrap();
    let text =
        [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    assert!(output.status.success(), "{}", text.concat());
}
