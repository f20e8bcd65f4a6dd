#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Maps with an Orbbec camera (Femto Bolt, Femto Mega, Gemini, Astra 2), until Ctrl-C.

  pip install pyorbbecsdk2        live_orbbec.py RESULTS [--sensor realsense_d435i]      (Gemini and Astra are stereo)

Every name of the API was checked against pyorbbecsdk2 2.1.2, and frames_of() tried with stand-ins for its frames.
Not tried with a camera: main(), with the alignment of depth to color and the schedule realtime.
"""
import live
import numpy as np
import pyorbbecsdk as ob


def camera_of(profile, sensor):
    """Returns the camera of the color images, whose lens has up to eight coefficients."""
    i, d = profile.get_intrinsic(), profile.get_distortion()
    return live.camera_of((i.width, i.height), i.fx, i.fy, i.cx, i.cy, d.model.name,
                          [d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6], fps=profile.get_fps(), sensor=sensor)


def frames_of(sets):
    """Returns frames of sets of a color (RGB) and an aligned depth frame (Y16), None for an incomplete set."""
    for frames in sets:
        color, depth = (frames.get_color_frame(), frames.get_depth_frame()) if frames else (None, None)
        if color is None or depth is None:
            yield None
            continue
        shape = color.get_height(), color.get_width()
        rgb = np.frombuffer(color.get_data(), np.uint8).reshape(*shape, 3)
        raw = np.frombuffer(depth.get_data(), np.uint16).reshape(shape)
        yield rgb, np.round(raw * depth.get_depth_scale()).astype(np.uint16), color.get_timestamp_us() / 1e6


def main():
    parser = live.parser(__doc__)
    parser.add_argument("--sensor", default="azure_kinect", help="noise model of the depth (default: azure_kinect)")
    arguments = parser.parse_args()
    pipeline, config, align = ob.Pipeline(), ob.Config(), ob.AlignFilter(ob.OBStreamType.COLOR_STREAM)
    colors = pipeline.get_stream_profile_list(ob.OBSensorType.COLOR_SENSOR)
    profile = colors.get_video_stream_profile(1280, 0, ob.OBFormat.RGB, 30)
    config.enable_stream(profile)
    depths = pipeline.get_stream_profile_list(ob.OBSensorType.DEPTH_SENSOR)
    config.enable_stream(depths.get_default_video_stream_profile())
    config.set_frame_aggregate_output_mode(ob.OBFrameAggregateOutputMode.FULL_FRAME_REQUIRE)
    pipeline.enable_frame_sync()
    pipeline.start(config)
    sets = (pipeline.wait_for_frames(1000) for _ in iter(int, 1))
    aligned = (frames and align.process(frames).as_frame_set() for frames in sets)
    return live.run(camera_of(profile, arguments.sensor), frames_of(aligned), arguments.results)


if __name__ == "__main__":
    live.start(main)
