//! SHA-256 (FIPS 180-4), so that no tool is needed to see whether `spirv/` is fresh.

/// Lower-case hexadecimal digest.
pub fn sha256(message: &[u8]) -> String {
    let primes: Vec<u128> = (2u128..312)
        .filter(|n| (2..*n).all(|d| n % d != 0))
        .collect();
    let rounds: Vec<u32> = primes
        .iter()
        .map(|prime| cube_root(prime << 96) as u32)
        .collect();
    let mut state: Vec<u32> = primes
        .iter()
        .take(8)
        .map(|prime| (prime << 64).isqrt() as u32)
        .collect();
    let mut padded = message.to_vec();
    padded.push(0x80);
    padded.resize((padded.len() + 8).next_multiple_of(64) - 8, 0);
    padded.extend((message.len() as u64 * 8).to_be_bytes());
    for block in padded.chunks_exact(64) {
        compress(&mut state, block, &rounds);
    }
    state.iter().map(|word| format!("{word:08x}")).collect()
}

fn compress(state: &mut [u32], block: &[u8], rounds: &[u32]) {
    let mut words: Vec<u32> = block
        .as_chunks()
        .0
        .iter()
        .map(|word| u32::from_be_bytes(*word))
        .collect();
    for i in 16..64 {
        let (a, b) = (words[i - 15], words[i - 2]);
        let (s0, s1) = (
            a.rotate_right(7) ^ a.rotate_right(18) ^ (a >> 3),
            b.rotate_right(17) ^ b.rotate_right(19) ^ (b >> 10),
        );
        words.push(
            words[i - 16]
                .wrapping_add(s0)
                .wrapping_add(words[i - 7])
                .wrapping_add(s1),
        );
    }
    let mut v = [0; 8];
    v.copy_from_slice(state);
    for (word, round) in words.iter().zip(rounds) {
        let [a, b, c, d, e, f, g, h] = v;
        let choice = (e & f) ^ (!e & g);
        let majority = (a & b) ^ (a & c) ^ (b & c);
        let s1 = e.rotate_right(6) ^ e.rotate_right(11) ^ e.rotate_right(25);
        let s0 = a.rotate_right(2) ^ a.rotate_right(13) ^ a.rotate_right(22);
        let t = h
            .wrapping_add(s1)
            .wrapping_add(choice)
            .wrapping_add(*round)
            .wrapping_add(*word);
        v = [
            t.wrapping_add(s0).wrapping_add(majority),
            a,
            b,
            c,
            d.wrapping_add(t),
            e,
            f,
            g,
        ];
    }
    for (total, word) in state.iter_mut().zip(v) {
        *total = total.wrapping_add(word);
    }
}

/// Largest integer whose cube is at most `value`.
fn cube_root(value: u128) -> u128 {
    let (mut low, mut high) = (0u128, 1 << 40);
    while high - low > 1 {
        let middle = (low + high) / 2;
        if middle * middle * middle <= value {
            low = middle
        } else {
            high = middle
        }
    }
    low
}
