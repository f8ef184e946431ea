"""Whether systems from elsewhere do here what their authors say."""
