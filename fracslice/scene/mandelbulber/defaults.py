"""Defaults of the parameters of Mandelbulber's formulas: a file holds only what differs from them."""

from __future__ import annotations

_TEXT = """
formula=int(fractal::none); formula_iterations=1; formula_weight=1; formula_start_iteration=0
formula_stop_iteration=250; julia_mode=false; julia_c=0 0 0; fractal_constant_factor=1 1 1; initial_waxis=0
formula_material_id=1; fractal_enable=true; dont_add_c_constant=false; check_for_bailout=true
formula_maxiter=250; power=9; alpha_angle_offset=0; beta_angle_offset=0; gamma_angle_offset=0; degree=3
cadd=-1.3; IFS_scale=2; IFS_rotation=0 0 0; IFS_rotation_enabled=false; IFS_offset=1 0 0; IFS_edge=0 0 0
IFS_edge_enabled=false; IFS_abs_x=false; IFS_abs_y=false; IFS_abs_z=false; IFS_menger_sponge_mode=false
IFS_direction=1 0 0; IFS_rotations=0 0 0; IFS_distance=0; IFS_intensity=1; IFS_enabled=false
mandelbox_scale=2; mandelbox_folding_limit=1; mandelbox_folding_value=2; mandelbox_folding_min_radius=0.5
mandelbox_folding_fixed_radius=1; mandelbox_sharpness=3; mandelbox_offset=0 0 0
mandelbox_rotation_main=0 0 0; mandelbox_rotation_neg=0 0 0; mandelbox_rotation_pos=0 0 0
mandelbox_color=0.03 0.05 0.07; mandelbox_color_4D=0.03 0.05 0.07 0; mandelbox_color_R=0
mandelbox_color_Sp1=0.2; mandelbox_color_Sp2=0.2; mandelbox_main_rotation_enabled=false
mandelbox_rotations_enabled=false; mandelbox_solid=1; mandelbox_melt=0; mandelbox_vary_scale_vary=0
mandelbox_vary_fold=1; mandelbox_vary_minr=0.5; mandelbox_vary_rpower=1; mandelbox_vary_wadd=0
mandelbox_generalized_fold_type=0; boxfold_bulbpow2_folding_factor=2; boxfold_bulbpow2_z_factor=5
buffalo_preabs_x=false; buffalo_preabs_y=false; buffalo_preabs_z=false; buffalo_abs_x=false
buffalo_abs_y=false; buffalo_abs_z=false; buffalo_pos_z=false; aboxMod1_foldM=0 0 0
mandelbulbMulti_acos_or_asin=0; mandelbulbMulti_atan_or_atan2=0; mandelbulbMulti_acos_or_asin_A=0
mandelbulbMulti_atan_or_atan2_A=0; mandelbulbMulti_order_of_xyz=0; mandelbulbMulti_order_of_xyz_2=0
mandelbulbMulti_order_of_xyz_C=0; sinTan2Trig_asin_or_acos=0; sinTan2Trig_atan2_or_atan=0
sinTan2Trig_order_of_zyx=0; surfFolds_order_of_folds_1=0; surfFolds_order_of_folds_2=0
surfFolds_order_of_folds_3=0; surfFolds_order_of_folds_4=0; surfFolds_order_of_folds_5=0
magTransf_order_of_transf_1=0; magTransf_order_of_transf_2=0; magTransf_order_of_transf_3=0
magTransf_order_of_transf_4=0; magTransf_order_of_transf_5=0; combo3=0; combo4=0; combo5=0; combo6=0
aSurf3Folds_order_of_folds_1=0; aSurf3Folds_order_of_folds_2=0; aSurf3Folds_order_of_folds_3=0
combo_mode_A=0; donut_ring_radius=1; donut_ring_thickness=0.1; donut_factor=3; donut_number=9
surfBox_enabledX1=true; surfBox_enabledY1=true; surfBox_enabledZ1=true; surfBox_enabledX2_false=false
surfBox_enabledY2_false=false; surfBox_enabledZ2_false=false; surfBox_enabledX3_false=false
surfBox_enabledY3_false=false; surfBox_enabledZ3_false=false; surfBox_enabledX4_false=false
surfBox_enabledY4_false=false; surfBox_enabledZ4_false=false; surfBox_enabledX5_false=false
surfBox_enabledY5_false=false; surfBox_enabledZ5_false=false; surfBox_offset1A_111=1 1 1
surfBox_offset1B_111=1 1 1; surfBox_offset2A_111=1 1 1; surfBox_offset2B_111=1 1 1
surfBox_offset3A_111=1 1 1; surfBox_offset3B_111=1 1 1; surfBox_offset1A_222=2 2 2
surfBox_offset1B_222=2 2 2; surfBox_scale1Z1=1; Cpara_enabledLinear=true; Cpara_enabledCurves=true
Cpara_enabledParab_false=false; Cpara_enabledParaAddP0=true; Cpara_para00=0; Cpara_paraA0=0; Cpara_paraB0=0
Cpara_paraC0=0; Cpara_para0=1; Cpara_paraA=1; Cpara_paraB=1; Cpara_paraC=1; Cpara_parab_offset0=0
Cpara_parab_offset=1; Cpara_parab_slope=0; Cpara_parab_scale=0; Cpara_iterA=250; Cpara_iterB=250
Cpara_iterC=250; analyticDE_enabled=true; analyticDE_enabled_false=false; analyticDE_scale_1=1
analyticDE_tweak_005=0.05; analyticDE_offset_0=0; analyticDE_offset_1=1; analyticDE_offset_2=1
analyticDE_start_iterations_A=0; analyticDE_stop_iterations_A=250; fold_color_aux_color_enabled=true
fold_color_aux_color_enabledA=true; fold_color_aux_color_enabled_false=false
fold_color_aux_color_enabledA_false=false; fold_color_aux_color_enabledB_false=false; fold_color_difs0=0
fold_color_difs1=1; fold_color_difs_0000=0 0 0 0; fold_color_start_iterations_A=0
fold_color_stop_iterations_A=250; fold_color_start_iterations_B=0; fold_color_stop_iterations_B=250
fold_color_int_0=0; fold_color_int_2=2; transf_angle_0=0; transf_angle_deg_A=0; transf_angle_deg_B=0
transf_angle_deg_C=0; transf_angle_45=45; transf_angle_72=72; transf_alpha_angle_offset=0
transf_beta_angle_offset=0; transf_folding_value=2; transf_folding_limit=1; transf_invert_0=0
transf_invert_1=1; transf_multiplication=2; transf_minimum_radius_0=0; transf_minimum_radius_05=0.5
transf_minimum_radius_06=0.6; transf_minR2_p25=0.25; transf_maxR2_1=1; transf_offset=0; transf_offset_0=0
transf_offsetA_0=0; transf_offsetB_0=0; transf_offsetC_0=0; transf_offsetD_0=0; transf_offsetE_0=0
transf_offsetF_0=0; transf_offsetR_0=0; transf_offset_0005=0.005; transf_offset_p01=0.01
transf_offsetA_p01=0.01; transf_offsetB_p01=0.01; transf_offset_p05=0.05; transf_offset_01=0.1
transf_offset_p1=0.1; transf_offset_02=0.2; transf_offset_05=0.5; transf_offsetA_05=0.5
transf_offsetB_05=0.5; transf_offset_1=1; transf_offsetA_1=1; transf_offsetR_1=1; transf_offsetT_1=1
transf_offset_105=1.5; transf_offset_2=2; transf_offsetA_2=2; transf_offsetE_2=2; transf_offsetF_2=2
transf_offsetR_2=2; transf_offset_3=3; transf_offset_4=4; transf_pwr_05=0.5; transf_pwr_4=4; transf_pwr_8=8
transf_pwr_8a=8; transf_radius_1=1; transf_scale_neg1=-1; transf_scale=1; transf_scale_0=0
transf_scaleA_0=0; transf_scaleB_0=0; transf_scaleC_0=0; transf_scale_025=0.25; transf_scale_05=0.5
transf_scale_08=0.8; transf_scale_1=1; transf_scaleA_1=1; transf_scaleB_1=1; transf_scaleC_1=1
transf_scaleD_1=1; transf_scaleE_1=1; transf_scaleF_1=1; transf_scaleG_1=1; transf_scale_1p1=1.1
transf_scale_015=1.5; transf_scale_2=2; transf_scaleA_2=2; transf_scale_3=3; transf_scaleA_3=3
transf_scaleB_3=3; transf_scale_4=4; transf_scale_5=5; transf_scale_6=6; transf_scale_8=8
transf_scale_16=16; transf_scale_25=25; transf_scale_main_2=2; transf_scale_vary_0=0; transf_int_A=0
transf_int_B=0; transf_int_1=1; transf_intA_1=1; transf_intB_1=1; transf_int_2=2; transf_int_3=3
transf_int_3_X=3; transf_int_3_Y=3; transf_int_3_Z=3; transf_int_6=6; transf_int8_X=8; transf_int8_Y=8
transf_int8_Z=8; transf_int_16=16; transf_int_32=32; transf_start_iterations=0
transf_start_iterations_250=250; transf_stop_iterations=250; transf_stop_iterations_15=15
transf_stop_iterations_50=50; transf_start_iterations_A=0; transf_stop_iterations_A=250
transf_start_iterations_B=0; transf_stop_iterations_B=250; transf_start_iterations_C=0
transf_stop_iterations_C=250; transf_stop_iterations_C1=1; transf_start_iterations_Cx=0
transf_stop_iterations_Cx=250; transf_start_iterations_Cy=0; transf_stop_iterations_Cy=250
transf_start_iterations_Cz=0; transf_stop_iterations_Cz=250; transf_start_iterations_D=0
transf_stop_iterations_D=250; transf_stop_iterations_D1=1; transf_start_iterations_E=0
transf_stop_iterations_E=250; transf_start_iterations_F=0; transf_stop_iterations_F=250
transf_start_iterations_G=0; transf_stop_iterations_G=250; transf_start_iterations_H=0
transf_stop_iterations_H=250; transf_start_iterations_I=0; transf_stop_iterations_I=250
transf_start_iterations_J=0; transf_stop_iterations_J=250; transf_start_iterations_K=0
transf_stop_iterations_K=250; transf_start_iterations_M=0; transf_stop_iterations_M=250
transf_start_iterations_N=0; transf_stop_iterations_N=250; transf_start_iterations_O=0
transf_stop_iterations_O=250; transf_start_iterations_P=0; transf_stop_iterations_P=250
transf_stop_iterations_P1=1; transf_start_iterations_R=0; transf_stop_iterations_R=250
transf_stop_iterations_R1=1; transf_start_iterations_RV=0; transf_stop_iterations_RV=250
transf_start_iterations_S=0; transf_stop_iterations_S=250; transf_start_iterations_T=0
transf_stop_iterations_T=250; transf_stop_iterationsT_1=1; transf_start_iterationsTM=0
transf_stop_iterationsTM_1=1; transf_start_iterations_X=0; transf_stop_iterations_X=250
transf_start_iterations_Y=0; transf_stop_iterations_Y=250; transf_start_iterations_Z=0
transf_stop_iterations_Z=250; transf_start_iterations_Zc=0; transf_stop_iterations_Zc=250
transf_stop_iterations_1=1; transf_addition_constant_0555=0.5 0.5 0.5
transf_addition_constant_0777=0.7 0.7 0.7; transf_addition_constant=0 0 0
transf_addition_constantA_000=0 0 0; transf_addition_constantP_000=0 0 0; transf_addition_constant_111=1 1 1
transf_addition_constantA_111=1 1 1; transf_addition_constant_222=2 2 2
transf_addition_constant_neg100=-1 0 0; transf_constant_julia_c=0 0 0; transf_constant_factor=1 2 2
transf_constant_multiplier_000=0 0 0; transf_constant_multiplier_001=0 0 1
transf_constant_multiplier_010=0 1 0; transf_constant_multiplier_100=1 0 0
transf_constant_multiplierA_100=1 0 0; transf_constant_multiplier_111=1 1 1
transf_constant_multiplierA_111=1 1 1; transf_constant_multiplierB_111=1 1 1
transf_constant_multiplierC_111=1 1 1; transf_constant_multiplier_121=1 2 1
transf_constant_multiplier_122=1 2 2; transf_constant_multiplier_221=2 2 1
transf_constant_multiplier_222=2 2 2; transf_constant_multiplier_441=4 4 1; transf_offset_000=0 0 0
transf_offsetA_000=0 0 0; transf_offsetF_000=0 0 0; transf_offset_001=0 0 1; transf_offset_002=0 0 2
transf_offset_010=0 1 0; transf_offset_100=1 0 0; transf_offset_101=1 0 1; transf_offset_110=1 1 0
transf_offset_1105=1 1 0.5; transf_offset_111=1 1 1; transf_offsetA_111=1 1 1; transf_offsetB_111=1 1 1
transf_offsetC_111=1 1 1; transf_offset_200=2 0 0; transf_offsetA_200=2 0 0; transf_offset_222=2 2 2
transf_offsetA_222=2 2 2; transf_offset_333=3 3 3; transf_power_025=0.25 0.25 0.25; transf_power_8=8 8 8
transf_rotation=0 0 0; transf_rotation2=0 0 0; transf_rotationXYZ=0 0 0; transf_rotation2XYZ=0 0 0
transf_rotationVary=0 0 0; transf_rotation44a=0 0 0; transf_rotation44b=0 0 0; transf_scaleP_222=0.2 0.2 0.2
transf_scale3D_000=0 0 0; transf_scale3D_111=1 1 1; transf_scale3D_222=2 2 2; transf_scale3Da_222=2 2 2
transf_scale3Db_222=2 2 2; transf_scale3Dc_222=2 2 2; transf_scale3Dd_222=2 2 2; transf_scale3D_333=3 3 3
transf_scale3D_444=4 4 4; transf_vec_111=1 1 1; transf_addition_constant_0000=0 0 0 0
transf_offset_0000=0 0 0 0; transf_offsetA_0000=0 0 0 0; transf_offsetB_0000=0 0 0 0
transf_offset_p5555=0.5 0.5 0.5 0.5; transf_offset_1111=1 1 1 1; transf_offsetA_1111=1 1 1 1
transf_offsetB_1111=1 1 1 1; transf_offset_neg_1111=-1 -1 -1 -1; transf_offset_2222=2 2 2 2
transf_addition_constant_111d5=1 1 1 0.5; transf_constant_multiplier_1220=1 2 2 0; transf_scale_0000=0 0 0 0
transf_scale_1111=1 1 1 1; transf_addCpixel_enabled=true; transf_addCpixel_enabled_false=false
transf_alternate_enabled_false=false; transf_benesi_T1_enabled=true; transf_benesi_T1_enabled_false=false
transf_benesi_T1M_enabled_false=false; transf_constant_julia_mode=false
transf_function_enabled4d_false=false; transf_function_enabled_auxC_false=false
transf_function_enabled=true; transf_function_enabled_false=false; transf_function_enabledx=true
transf_function_enabledy=true; transf_function_enabledz=true; transf_function_enabledw=true
transf_function_enabledx_false=false; transf_function_enabledy_false=false
transf_function_enabledz_false=false; transf_function_enabledw_false=false; transf_function_enabledAx=true
transf_function_enabledAy=true; transf_function_enabledAz=true; transf_function_enabledAw=true
transf_function_enabledAx_false=false; transf_function_enabledAy_false=false
transf_function_enabledAz_false=false; transf_function_enabledAw_false=false; transf_function_enabledBx=true
transf_function_enabledBy=true; transf_function_enabledBz=true; transf_function_enabledBx_false=false
transf_function_enabledBy_false=false; transf_function_enabledBz_false=false
transf_function_enabledBw_false=false; transf_function_enabledCx=true; transf_function_enabledCy=true
transf_function_enabledCz=true; transf_function_enabledCx_false=false; transf_function_enabledCy_false=false
transf_function_enabledCz_false=false; transf_function_enabledCw_false=false
transf_function_enabledA_false=false; transf_function_enabledB_false=false
transf_function_enabledC_false=false; transf_function_enabledD_false=false
transf_function_enabledE_false=false; transf_function_enabledF_false=false
transf_function_enabledG_false=false; transf_function_enabledH_false=false
transf_function_enabledI_false=false; transf_function_enabledJ_false=false
transf_function_enabledK_false=false; transf_function_enabledM=true; transf_function_enabledM_false=false
transf_function_enabledN_false=false; transf_function_enabledO_false=false
transf_function_enabledP_false=false; transf_function_enabledR_false=false
transf_function_enabledS_false=false; transf_function_enabledSw_false=false
transf_function_enabledT_false=false; transf_function_enabledX_false=false
transf_function_enabledY_false=false; transf_function_enabledZc_false=false; transf_rotation_enabled=false
transf_rotation_enabled_false=false; transf_rotation2_enabled_false=false
transf_sphere_inversion_enabled_false=false; transf_spheres_enabled=true; platonic_solid_frequency=1
platonic_solid_amplitude=1; platonic_solid_rhoMul=1; info=false; formula_code=e
"""

DEFAULTS = dict(
    item.strip().split("=", 1) for line in _TEXT.split("\n") for item in line.split(";") if item.strip()
)
"""Texts of the defaults by name; a numbered parameter stands here without its number."""
