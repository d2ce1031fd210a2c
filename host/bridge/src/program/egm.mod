MODULE {name}
  ! Position guidance (EGM, option 689-1): this computer plans the path and sends corrected set-points.
  ! Once, in Configuration, Communication, Transmission Protocol: name UCdevice, type UDPUC,
  ! remote address {host}, remote port {port}. External Motion Interface Data: name "giotto", level "Raw" or "Filtering".
  ! Never run on a real robot by the authors. First at 10 % speed, in manual mode, with nothing in reach.
  CONST num COND_MM := 0.1;
  ! Farthest that the tool may be led from where EGMRunPose has found it, mm.
  CONST num MOST_MM := 300;
  PERS tooldata tGiotto := [TRUE,[[0,0,0],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];
  ! The table holds in this work object.
  PERS wobjdata wGiotto := [FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  ! First row of the path: to be taught.
  CONST robtarget pFirst := [[0,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  LOCAL VAR egmident egmID;
  CONST egm_minmax WINDOW := [-COND_MM, COND_MM];

  PROC main()
    VAR pose noPose := [[0,0,0],[1,0,0,0]];
    MoveL pFirst, v20, fine, tGiotto \WObj:=wGiotto;
    EGMReset egmID;
    EGMGetId egmID;
    EGMSetupUC ROB_1, egmID, "giotto", "UCdevice" \Pose;
    EGMActPose egmID \Tool:=tGiotto \WObj:=wGiotto, noPose, EGM_FRAME_WOBJ, noPose, EGM_FRAME_WOBJ
      \x:=WINDOW \y:=WINDOW \z:=WINDOW \LpFilter:=0 \SampleRate:={cycle} \MaxPosDeviation:=MOST_MM \MaxSpeedDeviation:=50;
    ! Ends when the pose has been within the window for 5 s: the path is at its end.
    EGMRunPose egmID, EGM_STOP_RAMP_DOWN \x \y \z \CondTime:=5 \RampInTime:=0.5 \RampOutTime:=0.5;
    EGMReset egmID;
  ERROR
    ! ERR_UDPUC_COMM: this computer has gone silent.
    EGMReset egmID;
    Stop;
  ENDPROC
ENDMODULE
