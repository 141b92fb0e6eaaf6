"""Methods on volumes: view fusion, growth prior, diffusion, sampling."""
