//! Clocks of the device, where the system lets anybody read them.
//!
//! A GPU changes its clocks with its load and its heat. Times at other clocks cannot be compared.

use std::path::Path;
use std::process::Command;

use serde::{Deserialize, Serialize};

use crate::vulkan::{DeviceInfo, DeviceKind};

/// Clocks at one moment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Clocks {
    /// Of what runs shaders (MHz).
    pub core_mhz: u32,
    /// Of the memory (MHz), where it is told.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub memory_mhz: Option<u32>,
    /// Who told: `nvidia-smi`, or the kind of file of the kernel.
    pub source: String,
}

/// The clocks of a device now; `None` where nobody tells, or where it is not sure of which device.
pub fn read(device: &DeviceInfo) -> Option<Clocks> {
    match device.kind {
        DeviceKind::Cpu => of_processor(&std::fs::read_to_string("/proc/cpuinfo").ok()?),
        _ if device.driver.to_lowercase().contains("nvidia") => {
            let query = "--query-gpu=name,clocks.sm,clocks.mem";
            let output = Command::new("nvidia-smi")
                .args([query, "--format=csv,noheader,nounits"])
                .output();
            of_nvidia(&String::from_utf8_lossy(&output.ok()?.stdout), &device.name)
        }
        _ => of_kernel(Path::new("/sys/class/drm")),
    }
}

/// Of lines `name, core, memory`: those of the only device of this name.
fn of_nvidia(lines: &str, name: &str) -> Option<Clocks> {
    let mut rows = lines.lines().filter_map(|line| {
        let mut parts = line.rsplitn(3, ',').map(str::trim);
        let memory_mhz = parts.next()?.parse().ok()?;
        let core_mhz = parts.next()?.parse().ok()?;
        (parts.next()? == name).then_some([core_mhz, memory_mhz])
    });
    let [core_mhz, memory_mhz] = rows.next()?;
    rows.next().is_none().then(|| Clocks {
        core_mhz,
        memory_mhz: Some(memory_mhz),
        source: "nvidia-smi".to_owned(),
    })
}

/// Of the only card that has such files.
fn of_kernel(cards: &Path) -> Option<Clocks> {
    let folders = std::fs::read_dir(cards).ok()?.flatten();
    let mut found = folders.filter_map(|folder| {
        let text = |name: &str| std::fs::read_to_string(folder.path().join(name)).ok();
        let of_amd = |text: String| {
            let core_mhz = chosen_mhz(&text)?;
            Some((core_mhz, "pp_dpm_sclk"))
        };
        let of_intel = |text: String| Some((text.trim().parse().ok()?, "gt_act_freq_mhz"));
        let core = (text("device/pp_dpm_sclk").and_then(of_amd))
            .or_else(|| text("gt_act_freq_mhz").and_then(of_intel));
        core.map(|(core_mhz, source)| Clocks {
            core_mhz,
            memory_mhz: text("device/pp_dpm_mclk").and_then(|text| chosen_mhz(&text)),
            source: source.to_owned(),
        })
    });
    let clocks = found.next()?;
    found.next().is_none().then_some(clocks)
}

/// The frequency of the line with a star, as in `1: 1900Mhz *`.
fn chosen_mhz(levels: &str) -> Option<u32> {
    let line = levels.lines().find(|line| line.trim_end().ends_with('*'))?;
    let (_, rest) = line.split_once(':')?;
    let digits: String = rest
        .trim()
        .chars()
        .take_while(char::is_ascii_digit)
        .collect();
    digits.parse().ok()
}

/// The fastest core.
fn of_processor(text: &str) -> Option<Clocks> {
    let rows = text.lines().filter_map(|line| {
        let (name, value) = line.split_once(':')?;
        let mhz: f64 = value.trim().parse().ok()?;
        (name.trim() == "cpu MHz").then_some(mhz)
    });
    rows.reduce(f64::max).map(|mhz| Clocks {
        core_mhz: mhz.round() as u32,
        memory_mhz: None,
        source: "/proc/cpuinfo".to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_nvidia_tells_is_of_the_only_device_of_the_name() {
        let lines = "NVIDIA H200, 1980, 3201\nNVIDIA T4, 585, 5000\n";
        let clocks = of_nvidia(lines, "NVIDIA H200").map(|row| (row.core_mhz, row.memory_mhz));
        assert_eq!(clocks, Some((1980, Some(3201))));
        assert_eq!(of_nvidia(lines, "NVIDIA A10"), None);
        assert_eq!(of_nvidia(&lines.repeat(2), "NVIDIA T4"), None);
        assert_eq!(of_nvidia("NVIDIA T4, [N/A], 5000\n", "NVIDIA T4"), None);
    }

    #[test]
    fn files_of_the_kernel_are_of_the_only_card() -> std::io::Result<()> {
        let cards = tempfile::tempdir()?;
        let write = |card: &str, name: &str, text: &str| {
            let path = cards.path().join(card).join(name);
            std::fs::create_dir_all(cards.path().join(card).join("device"))?;
            std::fs::write(path, text)
        };
        let found = || of_kernel(cards.path()).map(|row| (row.core_mhz, row.memory_mhz));
        assert_eq!(found(), None);
        write("card0", "device/pp_dpm_sclk", "0: 500Mhz\n1: 1900Mhz *\n")?;
        write("card0", "device/pp_dpm_mclk", "0: 96Mhz *\n1: 1000Mhz\n")?;
        assert_eq!(found(), Some((1900, Some(96))));
        write("card1", "gt_act_freq_mhz", "1150\n")?;
        assert_eq!(found(), None);
        std::fs::remove_dir_all(cards.path().join("card0"))?;
        assert_eq!(found(), Some((1150, None)));
        Ok(())
    }

    #[test]
    fn a_processor_has_the_clock_of_its_fastest_core() {
        let clocks = |text: &str| of_processor(text).map(|row| row.core_mhz);
        let text = "model name : X\ncpu MHz : 2400.1\n\ncpu MHz : 3299.7\n";
        assert_eq!(clocks(text), Some(3300));
        assert_eq!(clocks("model name : X\n"), None);
    }
}
