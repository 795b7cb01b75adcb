"""The OpenCL side: choosing a device, laying out buffers, composing and building programs."""
