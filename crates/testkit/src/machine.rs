//! The machine that a report was measured on.

use std::{fmt, fs, process::Command, thread};

/// Machine, compiler, commit and seed: the header of every table with times in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Machine {
    /// Processor model, "unknown" if `/proc/cpuinfo` does not name it.
    pub cpu: String,
    /// Cores this process may use; 0 if unknown.
    pub cores: usize,
    /// Output of `rustc --version` when this crate was compiled.
    pub rustc: String,
    /// Short commit of the working directory, `+changes` when tracked files differ from it, "unknown"
    /// without git.
    pub commit: String,
    /// Seed of the inputs.
    pub seed: u64,
}

impl Machine {
    /// Queries the system; `seed`: of the report's inputs.
    #[must_use]
    pub fn detect(seed: u64) -> Self {
        Self {
            cpu: cpu_model(&fs::read_to_string("/proc/cpuinfo").unwrap_or_default()),
            cores: thread::available_parallelism().map_or(0, usize::from),
            rustc: env!("HWALL_RUSTC_VERSION").to_owned(),
            commit: commit(),
            seed,
        }
    }
}

impl fmt::Display for Machine {
    /// One line of Markdown.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            cpu,
            cores,
            rustc,
            commit,
            seed,
        } = self;
        write!(
            f,
            "CPU: {cpu}, {cores} cores · {rustc} · commit {commit} · seed {seed}"
        )
    }
}

fn cpu_model(cpuinfo: &str) -> String {
    let named = cpuinfo.lines().filter_map(|line| line.split_once(':'));
    let mut models = named
        .filter(|(key, _)| key.trim() == "model name")
        .map(|(_, model)| model.trim());
    models.next().unwrap_or("unknown").to_owned()
}

fn commit() -> String {
    let Some(hash) = git(&["rev-parse", "--short", "HEAD"]) else {
        return "unknown".to_owned();
    };
    match git(&["status", "--porcelain", "--untracked-files=no"]) {
        Some(changes) if changes.is_empty() => hash,
        _ => hash + "+changes",
    }
}

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::cpu_model;

    #[test]
    fn cpu_model_is_the_first_one_named() {
        let text = "processor\t: 0\nmodel\t\t: 7\nmodel name\t: A 9: fast\n\nmodel name\t: B\n";
        assert_eq!(cpu_model(text), "A 9: fast");
        assert_eq!(cpu_model(""), "unknown");
    }
}
