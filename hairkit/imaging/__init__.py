"""Methods on images: filters, segmentation, matting, waves."""
