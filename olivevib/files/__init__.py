"""Whatever touches a disk or a device: videos, stamps, stores, sensors, prints, exports."""
