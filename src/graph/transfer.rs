//! Uploads, which go with the next submission, and readbacks, which are waited for.

use std::sync::Arc;

use super::frame::{Frame, Resource, Work};
use super::stats::FrameStats;
use super::{Access, Gpu};
use crate::vulkan::{Buffer, BufferDesc, BufferUsage, Error, Image, ImageRegion, Owner};

/// So many bytes wait for the next submission, at most.
const WAITING_BYTES: u64 = 16 << 20;

impl Gpu {
    /// Copies bytes to the start of a buffer, before all work that is submitted from now on.
    pub fn upload_buffer(&self, buffer: &Arc<Buffer>, bytes: &[u8]) -> Result<(), Error> {
        let size = bytes.len() as u64;
        assert!(
            size <= buffer.size_bytes(),
            "buffer {}: {size} bytes do not fit into {}",
            buffer.name(),
            buffer.size_bytes()
        );
        if bytes.is_empty() {
            return Ok(());
        }
        let name = format!("upload {}", buffer.name());
        let mut frame = Frame::new();
        if buffer.usage() == BufferUsage::Uniform {
            self.note(|host| host.writes += 1);
            frame.set(name, buffer, bytes);
            self.enqueue(frame);
            return Ok(());
        }
        let staging = self.stage(buffer.name(), bytes)?;
        frame.copy_buffer(name, (&staging, 0), (buffer, 0), size);
        self.upload(frame, size)
    }

    /// Copies texels to one mip and layer of an image, before all work that is submitted from now
    /// on.
    pub fn upload_image(
        &self,
        image: &Arc<Image>,
        mip: u32,
        layer: u32,
        bytes: &[u8],
    ) -> Result<(), Error> {
        let wanted = check_region(image, mip, layer);
        assert_eq!(
            bytes.len() as u64,
            wanted,
            "image {}: bytes of mip {mip}",
            image.name()
        );
        let part = None;
        self.upload_region(image, ImageRegion { mip, layer, part }, bytes)
    }

    /// Copies whole rows of texels, from a row on, to an image without mips and layers, likewise.
    pub fn upload_rows(
        &self,
        image: &Arc<Image>,
        first_row: u32,
        bytes: &[u8],
    ) -> Result<(), Error> {
        let [width, height, depth] = image.extent(0);
        let row_bytes = check_region(image, 0, 0) / u64::from(height);
        let count = (bytes.len() as u64 / row_bytes) as u32;
        assert!(
            (bytes.len() as u64).is_multiple_of(row_bytes)
                && first_row + count <= height
                && depth == 1,
            "image {}: {} bytes from row {first_row} on",
            image.name(),
            bytes.len()
        );
        let region = ImageRegion {
            mip: 0,
            layer: 0,
            part: Some([[0, first_row, 0], [width, count, 1]]),
        };
        self.upload_region(image, region, bytes)
    }

    fn upload_region(
        &self,
        image: &Arc<Image>,
        region: ImageRegion,
        bytes: &[u8],
    ) -> Result<(), Error> {
        let staging = self.stage(image.name(), bytes)?;
        let mut frame = Frame::new();
        let (from, to) = (
            Resource::from(&staging),
            Resource::Image(Arc::clone(image), region.mip..region.mip + 1),
        );
        let uses = vec![
            (from.clone(), from.used(Access::TransferRead)),
            (to.clone(), to.used(Access::TransferWrite)),
        ];
        let work = Work::ToImage {
            source: staging,
            target: Arc::clone(image),
            region,
        };
        frame.push(format!("upload {}", image.name()), uses, work);
        self.upload(frame, bytes.len() as u64)
    }

    /// The contents of a buffer, once all work before has finished.
    pub fn read_buffer(&self, buffer: &Arc<Buffer>) -> Result<Vec<u8>, Error> {
        let (stats, bytes) = self.submit_and_read(Frame::new(), buffer)?;
        self.tell_later(stats);
        Ok(bytes)
    }

    /// Runs a frame, and gives what is then in a buffer: one submission.
    pub fn submit_and_read(
        &self,
        frame: Frame,
        buffer: &Arc<Buffer>,
    ) -> Result<(FrameStats, Vec<u8>), Error> {
        let (stats, contents) = self.submit_and_read_all(frame, &[buffer])?;
        Ok((stats, contents.into_iter().next().unwrap_or_default()))
    }

    /// The same for several buffers.
    pub fn submit_and_read_all(
        &self,
        mut frame: Frame,
        buffers: &[&Arc<Buffer>],
    ) -> Result<(FrameStats, Vec<Vec<u8>>), Error> {
        let mut sources = Vec::with_capacity(buffers.len());
        for buffer in buffers {
            sources.push(if buffer.usage() == BufferUsage::Storage {
                let staging = self.readback(buffer.name(), buffer.size_bytes())?;
                frame.copy_for_host(buffer, 0, &staging);
                staging
            } else {
                Arc::clone(buffer)
            });
        }
        self.read_after(frame, &sources)
    }

    /// Part of a storage buffer, from a byte on, once all work before has finished.
    pub fn read_part(
        &self,
        buffer: &Arc<Buffer>,
        first_byte: u64,
        size_bytes: u64,
    ) -> Result<Vec<u8>, Error> {
        let mut frame = Frame::new();
        let staging = self.readback(buffer.name(), size_bytes)?;
        frame.copy_for_host(buffer, first_byte, &staging);
        self.read_one(frame, staging)
    }

    /// The texels of one mip and layer of an image, tightly packed, once all work before has
    /// finished.
    pub fn read_image(&self, image: &Arc<Image>, mip: u32, layer: u32) -> Result<Vec<u8>, Error> {
        let bytes = check_region(image, mip, layer);
        let part = None;
        self.read_region(image, ImageRegion { mip, layer, part }, bytes)
    }

    /// The finest texels of a texture of a material, which is then as it was: frames that use
    /// materials take for granted that it can be sampled.
    pub fn read_texture(&self, image: &Arc<Image>) -> Result<Vec<u8>, Error> {
        let texels = self.read_image(image, 0, 0)?;
        self.make_ready(&[image]);
        Ok(texels)
    }

    /// One texel of the finest mip of an image without layers, once all work before has finished.
    pub fn read_texel(&self, image: &Arc<Image>, texel: [u32; 3]) -> Result<Vec<u8>, Error> {
        let (extent, name) = (image.extent(0), image.name());
        let is_there = texel.iter().zip(extent).all(|(at, size)| *at < size);
        let [x, y, z] = texel;
        assert!(is_there, "image {name}: no texel {x}, {y}, {z}");
        let texels: u64 = extent.map(u64::from).iter().product();
        let bytes = check_region(image, 0, 0) / texels;
        let region = ImageRegion {
            mip: 0,
            layer: 0,
            part: Some([texel, [1; 3]]),
        };
        self.read_region(image, region, bytes)
    }

    fn read_region(
        &self,
        image: &Arc<Image>,
        region: ImageRegion,
        size_bytes: u64,
    ) -> Result<Vec<u8>, Error> {
        let staging = self.readback(image.name(), size_bytes)?;
        let mut frame = Frame::new();
        let (from, to) = (
            Resource::Image(Arc::clone(image), region.mip..region.mip + 1),
            Resource::from(&staging),
        );
        let uses = vec![
            (from.clone(), from.used(Access::TransferRead)),
            (to.clone(), to.used(Access::TransferWrite)),
        ];
        let work = Work::FromImage {
            source: Arc::clone(image),
            region,
            target: Arc::clone(&staging),
        };
        frame.push_untold(format!("read {}", image.name()), uses, work);
        self.read_one(frame, staging)
    }

    fn read_after(
        &self,
        mut frame: Frame,
        buffers: &[Arc<Buffer>],
    ) -> Result<(FrameStats, Vec<Vec<u8>>), Error> {
        for buffer in buffers {
            let resource = Resource::from(buffer);
            let used = resource.used(Access::HostRead);
            frame.push_untold(
                format!("host read {}", buffer.name()),
                vec![(resource, used)],
                Work::Nothing,
            );
        }
        let stats = self.submit(frame)?;
        self.note(|host| host.readbacks += buffers.len() as u64);
        let contents = buffers.iter().map(|buffer| buffer.read_mapped());
        Ok((stats, contents.collect()))
    }

    /// What a frame leaves in one buffer.
    fn read_one(&self, frame: Frame, buffer: Arc<Buffer>) -> Result<Vec<u8>, Error> {
        let (stats, contents) = self.read_after(frame, &[buffer])?;
        // Of what waited: reading costs nothing that is told.
        self.tell_later(stats);
        Ok(contents.into_iter().next().unwrap_or_default())
    }

    /// Keeps what brings so many bytes to the device for the next submission.
    fn upload(&self, frame: Frame, bytes: u64) -> Result<(), Error> {
        if self.enqueue_upload(frame, bytes) <= WAITING_BYTES {
            return Ok(());
        }
        self.submit_early()
    }

    /// A buffer of the host's with these bytes, for frames to copy from.
    pub(crate) fn stage(&self, name: &str, bytes: &[u8]) -> Result<Arc<Buffer>, Error> {
        let staging = self.create_buffer(&BufferDesc {
            name: format!("{name} (staging)"),
            size_bytes: bytes.len() as u64,
            usage: BufferUsage::Staging,
            owner: Owner::Shared,
        })?;
        staging.write_mapped(0, bytes);
        Ok(staging)
    }

    fn readback(&self, name: &str, size_bytes: u64) -> Result<Arc<Buffer>, Error> {
        self.create_buffer(&BufferDesc {
            name: format!("{name} (readback)"),
            size_bytes,
            usage: BufferUsage::Readback,
            owner: Owner::Shared,
        })
    }
}

/// Size of one mip and layer (bytes).
fn check_region(image: &Image, mip: u32, layer: u32) -> u64 {
    assert!(
        mip < image.mips() && layer < image.desc().layers,
        "image {}: no mip {mip}, layer {layer}",
        image.name()
    );
    let bytes = image.mip_bytes(mip);
    assert!(
        bytes.is_some(),
        "image {}: format {:?} cannot be copied to or from the host",
        image.name(),
        image.desc().format
    );
    bytes.unwrap_or_default()
}
