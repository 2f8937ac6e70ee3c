"""The message types of Drake."""

from __future__ import annotations

from sheldrake.lcm._message import Message


class lcmt_scope(Message):
    """A vector at a time [us]."""

    layout = "int64_t utime; int32_t size; double value[size]"


class lcmt_schunk_wsg_command(Message):
    """Where a WSG gripper's fingers should be [mm] apart, and the most force [N]."""

    layout = "int64_t utime; double target_position_mm, force"


class lcmt_schunk_wsg_status(Message):
    """How far apart a WSG gripper's fingers are [mm], how fast they part [mm/s], and their force [N]."""

    layout = "int64_t utime; double actual_position_mm, actual_force, actual_speed_mm_per_s"


class lcmt_iiwa_command(Message):
    """Positions [rad] and torques [N m] for an iiwa."""

    layout = """
        int64_t utime; int32_t num_joints; double joint_position[num_joints]; int32_t num_torques;
        double joint_torque[num_torques]
    """


class lcmt_iiwa_status(Message):
    """What an iiwa measures and was commanded: positions [rad], velocities [rad/s], torques [N m]."""

    layout = """
        int64_t utime; int32_t num_joints; double joint_position_measured[num_joints],
        joint_velocity_estimated[num_joints], joint_position_commanded[num_joints],
        joint_position_ipo[num_joints], joint_torque_measured[num_joints], joint_torque_commanded[num_joints],
        joint_torque_external[num_joints]
    """


class lcmt_header(Message):
    """Number, time [us] and name of a message."""

    layout = "int32_t seq; int64_t utime; string frame_name"


class lcmt_image(Message):
    """An image: rows of pixels, compressed or not."""

    PIXEL_FORMAT_GRAY, PIXEL_FORMAT_RGB, PIXEL_FORMAT_BGR, PIXEL_FORMAT_RGBA, PIXEL_FORMAT_BGRA = 0, 1, 2, 3, 4
    PIXEL_FORMAT_DEPTH, PIXEL_FORMAT_LABEL, PIXEL_FORMAT_MASK, PIXEL_FORMAT_DISPARITY = 5, 6, 7, 8
    PIXEL_FORMAT_BAYER_BGGR, PIXEL_FORMAT_BAYER_RGGB, PIXEL_FORMAT_BAYER_GBRG, PIXEL_FORMAT_BAYER_GRBG = 9, 10, 11, 12
    CHANNEL_TYPE_INT8, CHANNEL_TYPE_UINT8, CHANNEL_TYPE_INT16, CHANNEL_TYPE_UINT16 = 0, 1, 2, 3
    CHANNEL_TYPE_INT32, CHANNEL_TYPE_UINT32, CHANNEL_TYPE_FLOAT32, CHANNEL_TYPE_FLOAT64 = 4, 5, 6, 7
    COMPRESSION_METHOD_NOT_COMPRESSED, COMPRESSION_METHOD_ZLIB = 0, 1
    COMPRESSION_METHOD_JPEG, COMPRESSION_METHOD_PNG = 2, 3
    PIXEL_FORMAT_INVALID = CHANNEL_TYPE_INVALID = COMPRESSION_METHOD_INVALID = -1

    layout = """
        lcmt_header header; int32_t width, height, row_stride, size; byte data[size]; boolean bigendian;
        int8_t pixel_format, channel_type, compression_method
    """


class lcmt_image_array(Message):
    """Images taken together."""

    layout = "lcmt_header header; int32_t num_images; lcmt_image images[num_images]"


class lcmt_panda_command(Message):
    """Positions [rad], velocities [rad/s] and torques [N m] for a Panda, and which of them it should follow."""

    layout = """
        int64_t utime; int32_t num_joint_position; double joint_position[num_joint_position];
        int32_t num_joint_velocity; double joint_velocity[num_joint_velocity]; int32_t num_joint_torque;
        double joint_torque[num_joint_torque]; int8_t control_mode_expected
    """
    CONTROL_MODE_POSITION, CONTROL_MODE_VELOCITY, CONTROL_MODE_TORQUE = 1, 2, 4


class lcmt_panda_status(Message):
    """What a Panda measures and was commanded: positions [rad], velocities [rad/s], torques [N m]."""

    layout = """
        int64_t utime; int32_t num_joints; double joint_position[num_joints],
        joint_position_desired[num_joints], joint_velocity[num_joints], joint_velocity_desired[num_joints],
        joint_acceleration_desired[num_joints], joint_torque[num_joints], joint_torque_desired[num_joints],
        joint_torque_external[num_joints], control_command_success_rate; int8_t robot_mode; int64_t robot_utime;
        int8_t control_mode
    """
    CONTROL_MODE_POSITION, CONTROL_MODE_VELOCITY, CONTROL_MODE_TORQUE = 1, 2, 4


class lcmt_point(Message):
    """A point [m]."""

    layout = "double x, y, z"


class lcmt_point_pair_contact_info_for_viz(Message):
    """A contact point, the force on body 2 there, and the normal from body 2 to body 1."""

    layout = "int64_t timestamp; string body1_name, body2_name; double contact_point[3], contact_force[3], normal[3]"


class lcmt_hydroelastic_quadrature_per_point_data_for_viz(Message):
    """Slip and traction at a point of a contact surface."""

    layout = "double p_WQ[3], vt_BqAq_W[3], traction_Aq_W[3]"


class lcmt_hydroelastic_contact_surface_for_viz(Message):
    """A contact surface: whose it is, its resultant force, its polygons with their pressure."""

    layout = """
        string geometry1_name, body1_name, model1_name; boolean body1_unique; int32_t collision_count1;
        string geometry2_name, body2_name, model2_name; boolean body2_unique; int32_t collision_count2;
        double centroid_W[3], force_C_W[3], moment_C_W[3]; int32_t num_quadrature_points;
        lcmt_hydroelastic_quadrature_per_point_data_for_viz quadrature_point_data[num_quadrature_points];
        int32_t num_vertices; lcmt_point p_WV[num_vertices]; double pressure[num_vertices];
        int32_t poly_data_int_count, poly_data[poly_data_int_count]
    """


class lcmt_contact_results_for_viz(Message):
    """All contacts at one time [us]."""

    layout = """
        int64_t timestamp; int32_t num_point_pair_contacts;
        lcmt_point_pair_contact_info_for_viz point_pair_contact_info[num_point_pair_contacts];
        int32_t num_hydroelastic_contacts;
        lcmt_hydroelastic_contact_surface_for_viz hydroelastic_contacts[num_hydroelastic_contacts]
    """


class lcmt_point_cloud_field(Message):
    """One channel of a cloud: where it is in the bytes of a point, and of what type."""

    INT8, UINT8, INT16, UINT16, INT32, UINT32, FLOAT32, FLOAT64 = 1, 2, 3, 4, 5, 6, 7, 8

    layout = "string name; int32_t byte_offset; int8_t datatype; int32_t count"


class lcmt_point_cloud(Message):
    """A cloud at a time [us], in a frame; the bytes of its points are in `data`."""

    IS_BIGENDIAN, IS_STRICTLY_FINITE = 1, 2

    layout = """
        int64_t utime; string frame_name; int64_t width, height; int32_t num_fields;
        lcmt_point_cloud_field fields[num_fields]; int64_t flags; int32_t point_step; int64_t row_step;
        int16_t filler_size; byte filler[filler_size]; int64_t data_size; byte data[data_size]
    """


class lcmt_viewer_geometry_data(Message):
    """A shape on a link: its kind and sizes, its pose, quaternion w x y z, in the link's frame, and its color.

    A mesh is a file's path and three scales, or without a path its own numbers: number of vertices, number of
    triangles, vertices, indices.
    """

    BOX, SPHERE, CYLINDER, MESH, CAPSULE, ELLIPSOID = 1, 2, 3, 4, 5, 6

    layout = """
        int8_t type; float position[3], quaternion[4], color[4]; string string_data; int32_t num_float_data;
        float float_data[num_float_data]
    """


class lcmt_viewer_link_data(Message):
    """A link with its shapes."""

    layout = "string name; int32_t robot_num, num_geom; lcmt_viewer_geometry_data geom[num_geom]"


class lcmt_viewer_load_robot(Message):
    """All links that there are."""

    layout = "int32_t num_links; lcmt_viewer_link_data link[num_links]"


class lcmt_viewer_draw(Message):
    """Poses of links in the world at a time [ms]."""

    layout = """
        int64_t timestamp; int32_t num_links; string link_name[num_links]; int32_t robot_num[num_links];
        float position[num_links][3], quaternion[num_links][4]
    """


# ---- of no system here: for programs that talk to others


class lcmt_quaternion(Message):
    """A quaternion."""

    layout = "double w, x, y, z"


class lcmt_robot_state(Message):
    """Positions of joints, by name [m or rad], at a time [us]."""

    layout = "int64_t utime; int16_t num_joints; string joint_name[num_joints]; float joint_position[num_joints]"


class lcmt_robot_plan(Message):
    """States to go through, one after the other."""

    layout = "int64_t utime; int32_t num_states; lcmt_robot_state plan[num_states]"


class lcmt_force_torque(Message):
    """A force [N] and a torque [N m] at a time [us]."""

    layout = "int64_t timestamp; double fx, fy, fz, tx, ty, tz"


class lcmt_drake_signal(Message):
    """A vector with names at a time [ms]."""

    layout = "int32_t dim; double val[dim]; string coord[dim]; int64_t timestamp"


class lcmt_acrobot_u(Message):
    """Torque of an acrobot's elbow [N m]."""

    layout = "int64_t timestamp; double tau"


class lcmt_acrobot_x(Message):
    """State of an acrobot [rad, rad/s]."""

    layout = "int64_t timestamp; double theta1, theta1Dot, theta2, theta2Dot"


class lcmt_acrobot_y(Message):
    """What an acrobot's sensors see: angles [rad] and torque [N m]."""

    layout = "int64_t timestamp; double theta1, theta2, tau"


class lcmt_allegro_command(Message):
    """Positions [rad] and torques [N m] for an Allegro hand."""

    layout = """
        int64_t utime; int32_t num_joints; double joint_position[num_joints]; int32_t num_torques;
        double joint_torque[num_torques]
    """


class lcmt_allegro_status(Message):
    """What an Allegro hand measures and was commanded: positions [rad], velocities [rad/s], torques [N m]."""

    layout = """
        int64_t utime; int32_t num_joints; double joint_position_measured[num_joints],
        joint_velocity_estimated[num_joints], joint_position_commanded[num_joints],
        joint_torque_commanded[num_joints]
    """


class lcmt_jaco_command(Message):
    """Positions [rad] and velocities [rad/s] for joints and fingers of a Jaco arm."""

    layout = """
        int64_t utime; int32_t num_joints; double joint_position[num_joints], joint_velocity[num_joints];
        int32_t num_fingers; double finger_position[num_fingers], finger_velocity[num_fingers]
    """


class lcmt_jaco_status(Message):
    """What a Jaco arm measures: positions [rad], velocities [rad/s], torques [N m] and currents [A]."""

    layout = """
        int64_t utime; int32_t num_joints; double joint_position[num_joints], joint_velocity[num_joints],
        joint_torque[num_joints], joint_torque_external[num_joints], joint_current[num_joints];
        int32_t num_fingers; double finger_position[num_fingers], finger_velocity[num_fingers],
        finger_torque[num_fingers], finger_torque_external[num_fingers], finger_current[num_fingers]
    """


class lcmt_iiwa_status_telemetry(Message):
    """Clocks of a computer and an iiwa [us], and how far they are apart."""

    layout = "int64_t host_utime, iiwa_utime, estimated_dt_host_minus_iiwa"


class lcmt_viewer_command(Message):
    """Asks a viewer for something, or answers."""

    STATUS, LOAD_MODEL, LOAD_RENDERER, SHUTDOWN, START_RECORDING, STOP_RECORDING = 0, 1, 2, 3, 4, 5
    LOAD_TERRAIN, SET_TERRAIN_TRANSFORM = 6, 7
    layout = "int8_t command_type; string command_data"


class lcmt_planar_plant_state(Message):
    """The state of a plant [m or rad, m/s or rad/s] at a time [us]."""

    layout = "int64_t utime; int32_t num_states; double plant_state[num_states]"
