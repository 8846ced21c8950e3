//! Vector registers that dense products leave in use.
//!
//! The crate's products of matrices are in assembler, and do not mark the upper halves of vector registers as free when they end. From then on every narrow instruction on that thread keeps these halves as they are and
//! waits for whatever wrote the register last: on an AMD EPYC, flips of a triangulation took 2.6 times as long after a factorisation. Compilers mark them at the end of functions that they compile for wide vectors, but take calls
//! for clean; so whatever calls such products ends with [`free`].

/// Marks the upper halves of this thread's vector registers as free.
#[inline]
pub(super) fn free() {
    #[cfg(target_arch = "x86_64")]
    if let Some(avx) = pulp::core_arch::x86::Avx::try_new() {
        avx._mm256_zeroupper();
    }
}
